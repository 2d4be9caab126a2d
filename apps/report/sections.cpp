#include "apps/report/sections.h"

#include <fmt/core.h>
#include <algorithm>

#include "apps/report/parts.h"

namespace skerry::report {
namespace {

// Series by row label, over host load.
std::vector<Series> series_of(const Json& scene, const char* figure) {
  std::vector<Series> all;
  for (const Json& row : scene.at("frames")) {
    const std::string label = row.at("label");
    auto found =
        std::find_if(all.begin(), all.end(), [&](const Series& s) { return s.label == label; });
    if (found == all.end()) {
      all.push_back({label, row_class(row), {}});
      found = all.end() - 1;
    }
    const Json& values = row.at(figure);
    if (values.at("max").get<double>() <= 0) continue;  // nothing was seen
    found->points.push_back({row.at("host_ms"), values.at("p95"), values.at("p95_interval")[0],
                             values.at("p95_interval")[1]});
  }
  return all;
}

std::vector<Series> missed_of(const Json& scene) {
  std::vector<Series> all = series_of(scene, "frame_ms");
  for (Series& series : all) {
    for (Point& point : series.points) {
      for (const Json& row : scene.at("frames")) {
        if (row.at("label") != series.label || row.at("host_ms") != point.x) continue;
        point.y = point.low = point.high = 100 * row.at("missed_share").get<double>();
      }
    }
  }
  return all;
}

std::string frame_charts(const Json& scene, const std::string& colours) {
  if (scene.at("frames").empty()) return "";
  const double period_ms = 1e3 * scene.at("dt").get<double>();
  const std::string x_title = "host work per frame, ms";
  const std::string limit = "next frame due";
  std::string out = "<h3>Frames over host load</h3>\n" + colours + "<div class=charts>\n";
  out += svg({"Frame time, p95", "ms", x_title, series_of(scene, "frame_ms"), period_ms, limit,
              3 * period_ms});
  out += svg({"Input to visible, p95", "ms", x_title, series_of(scene, "input_to_visible_ms"), 0,
              "", 5 * period_ms});
  out += svg(
      {"Frames that ended late", "%", x_title, missed_of(scene), 5, "5 %: edge of the rate", 100});
  return out + "</div>\n<p class=soft>Bands are 95 % intervals.</p>\n";
}

std::string frame_table(const Json& rows) {
  if (rows.empty()) return "";
  std::string out =
      "<div class=scroll><table><tr><th>row<th>host ms<th>frame p50<th>p95<th>p99<th>max<th>late %"
      "<th>input p50<th>p95<th>age p50<th>step p50<th>p99<th>blocked<th>helped<th>CPU ms/frame"
      "<th>switches<th>dropped</tr>\n";
  for (const Json& row : rows) {
    const Json& frame = row.at("frame_ms");
    out += fmt::format(
        "<tr><td>{}<td>{:g}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}"
        "<td>{}<td>{}<td>{}</tr>\n",
        chip(row.at("label"), row_class(row)), row.at("host_ms").get<double>(),
        readable(frame.at("p50")), readable(frame.at("p95")), readable(frame.at("p99")),
        readable(frame.at("max")), number(100 * row.at("missed_share").get<double>(), 1),
        readable(row.at("input_to_visible_ms").at("p50")),
        readable(row.at("input_to_visible_ms").at("p95")),
        readable(row.at("state_age_ms").at("p50")), readable(row.at("step_ms").at("p50")),
        readable(row.at("step_ms").at("p99")), readable(row.at("blocked_ms").at("mean")),
        readable(row.at("helped_ms").at("mean")), readable(row.at("cpu_ms_per_frame")),
        readable(row.at("switches_per_frame")), row.at("dropped_steps").get<int>());
  }
  return out + "</table></div>\n";
}

std::string timeline_part(const Json& scene) {
  if (scene.at("timelines").empty()) return "";
  return fmt::format(
             "<h3>One typical frame per mode, {:g} ms of host work</h3>\n<p class=soft>Zero is "
             "when "
             "the frame was due; the dashed line is when the next is due; the solid line is the "
             "end "
             "of the frame.</p>\n",
             scene.at("timelines")[0].at("host_ms").get<double>()) +
         timelines(scene);
}

std::string steps_part(const Json& scene) {
  std::vector<Bar> speed_ups;
  std::vector<Stack> stages;
  const double work = scene.at("work_ms"), critical = scene.at("critical_path_ms");
  for (const Json& row : scene.at("throughput")) {
    const Json& speed_up = row.at("speed_up");
    const int workers = row.at("workers");
    Bar bar = {row.at("label"),
               row_class(row),
               speed_up.at("value"),
               speed_up.at("interval")[0],
               speed_up.at("interval")[1],
               workers > 1 ? row.at("allowed_speed_up").get<double>() : 0,
               ""};
    bar.text = fmt::format("{}× · {} ms", number(bar.value, 2),
                           readable(row.at("typical_ms").at("value")));
    speed_ups.push_back(bar);
    Stack stack = {row.at("label"), {}, ""};
    for (const Json& stage : row.at("stages")) {
      stack.parts.push_back({stage.at("name"), stage_class(stage.at("name")), stage.at("cpu_ms")});
    }
    stack.parts.push_back({"idle", "k-wait", row.at("idle_ms_per_step")});
    stack.text = fmt::format("{} ms idle", readable(row.at("idle_ms_per_step")));
    stages.push_back(stack);
  }
  std::string out = fmt::format(
      "<h3>Steps back to back: speed-up over serial</h3>\n<p class=soft>Work {} ms per step, "
      "critical "
      "path {} ms: with workers without end the graph allows {} times. The red mark is what it "
      "allows "
      "on the workers of the row, the dark line the 95 % interval.</p>\n",
      readable(work), readable(critical), critical > 0 ? readable(work / critical) : "–");
  out += bars(speed_ups, 1);
  out += "<h3>Where the processor time of a step goes</h3>\n" + stacks(stages);
  out += stage_legend();
  return out;
}

std::string step_table(const Json& scene) {
  std::string out =
      "<div class=scroll><table><tr><th>row<th>workers<th>step p50<th>p95<th>p99<th>max"
      "<th>Karp-Flatt<th>CPU s per simulated s<th>blocked ms<th>idle ms<th>imbalance<th>switches"
      "<th>forced<th>allocations<th>peak MB<th>idle CPU %<th>state</tr>\n";
  for (const Json& row : scene.at("throughput")) {
    const Json& step = row.at("step_ms");
    const Json& flatt = row.at("karp_flatt");
    const Json& difference = row.at("first_difference");
    out += fmt::format(
        "<tr><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}"
        "<td>{}<td>{}<td>{}</tr>\n",
        chip(row.at("label"), row_class(row)), row.at("workers").get<int>(),
        readable(step.at("p50")), readable(step.at("p95")), readable(step.at("p99")),
        readable(step.at("max")), flatt.is_null() ? "–" : number(flatt, 2),
        readable(row.at("cpu_s_per_simulated_s")), readable(row.at("blocked_ms_per_step")),
        readable(row.at("idle_ms_per_step")), number(row.at("imbalance"), 2),
        readable(row.at("switches_per_step")), readable(row.at("forced_switches_per_step")),
        readable(row.at("allocations_per_step")), readable(row.at("peak_mb")),
        number(100 * row.at("idle_cpu").get<double>(), 1),
        difference.is_null() ? "<span class=ok>equal</span>"
                             : fmt::format("<span class=bad>differs at step {}: {}</span>",
                                           difference.at("step").get<std::uint64_t>(),
                                           escaped(difference.at("where"))));
  }
  return out + "</table></div>\n";
}

std::string settings_part(const Json& scene) {
  if (scene.at("settings").empty()) return "";
  std::vector<Bar> rows;
  for (const Json& row : scene.at("settings")) {
    const Json& frame = row.at("frame_ms");
    Bar bar = {row.at("label"),
               row_class(row),
               frame.at("p95"),
               frame.at("p95_interval")[0],
               frame.at("p95_interval")[1],
               0,
               ""};
    bar.text = fmt::format("{} ms · {} ms CPU", number(bar.value, 2),
                           number(row.at("cpu_ms_per_frame"), 1));
    rows.push_back(bar);
  }
  return fmt::format(
             "<h3>Settings that can matter more than the mode</h3>\n<p class=soft>Frame time (p95) "
             "at "
             "{:g} ms of host work with one setting changed at a time, and processor time per "
             "frame.</p>\n",
             scene.at("settings")[0].at("host_ms").get<double>()) +
         bars(rows, 0);
}

std::string details(const char* title, const std::string& content) {
  if (content.empty()) return "";
  return fmt::format("<details><summary>{}</summary>\n{}</details>\n", title, content);
}

}  // namespace

std::string scene_section(const Json& scene, const std::string& colours) {
  std::string out = fmt::format(
      "<section class=card id=\"{0}\"><h2 style=\"margin-top:0\">{0}</h2>\n<p class=soft>{1} "
      "bodies, "
      "{2} joints, {3} contacts, {4} islands (largest {5}) · step 1/{6} s, {7} substeps, {8} steps "
      "after {9}, sleeping off · host work: {10}</p>\n<ul>\n",
      escaped(scene.at("scene")), count(scene.at("bodies")), count(scene.at("joints")),
      count(scene.at("contacts")), count(scene.at("islands")), count(scene.at("largest_island")),
      number(1 / scene.at("dt").get<double>(), 0), scene.at("substeps").get<int>(),
      scene.at("steps").get<int>(), scene.at("warmup").get<int>(), escaped(scene.at("host_shape")));
  for (const Json& sentence : scene.at("verdict")) {
    out += fmt::format("<li>{}</li>\n", escaped(sentence));
  }
  out += "</ul>\n" + frame_charts(scene, colours) + timeline_part(scene);
  if (!scene.at("throughput").empty() &&
      scene.at("throughput_repetitions").at("made").get<int>() > 0) {
    out += steps_part(scene);
  }
  out += settings_part(scene);
  out += details("All frame figures (ms)", frame_table(scene.at("frames")));
  out +=
      details("All frame figures with one setting changed (ms)", frame_table(scene.at("settings")));
  out += details("All step figures (ms, per step)", step_table(scene));
  return out + "</section>\n";
}

}  // namespace skerry::report
