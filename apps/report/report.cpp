#include "apps/report/report.h"

#include <fmt/core.h>
#include <algorithm>

#include "apps/report/parts.h"
#include "apps/report/sections.h"

namespace skerry::report {
namespace {

std::string load_text(double ms) { return fmt::format("{:g} ms", ms); }

std::string rate_text(const Json& scene) {
  return number(1 / scene.at("dt").get<double>(), 0) + " Hz";
}

std::string cell(const Json& scene, const Json& recommendation) {
  const auto& best = recommendation.at("best");
  std::string out = fmt::format("<div class=cell data-load=\"{}\"><div>",
                                load_text(recommendation.at("host_ms")));
  if (best.empty()) return out + "</div></div>";
  const auto holding = recommendation.at("holding").size(), edge = recommendation.at("edge").size();
  if (holding + edge == 0) {
    return out +
           fmt::format(
               "<span class=bad>none holds {}</span><small>{} misses least</small></div></div>",
               rate_text(scene), escaped(best[0]));
  }
  std::string label = chip_of(scene, best[0]);
  out += label.replace(label.find("chip "), 5, "chip strong ");
  for (std::size_t i = 1; i < best.size(); ++i) out += fmt::format(" {}", chip_of(scene, best[i]));
  out +=
      fmt::format("<small>input after {} ms</small>", number(recommendation.at("input_p95_ms"), 1));
  out += fmt::format("<small>{} of {} hold {}</small>", holding,
                     recommendation.at("modes").get<std::size_t>(), rate_text(scene));
  if (edge > 0) out += fmt::format("<small>{} at its edge</small>", edge);
  return out + "</div></div>";
}

std::string answer(const Json& results) {
  std::string rows;
  std::size_t loads = 1;
  std::string head;
  for (const Json& scene : results.at("scenes")) {
    const auto& recommendations = scene.at("recommendations");
    if (recommendations.empty()) continue;
    if (head.empty()) {
      loads = recommendations.size();
      head = "<div class=head><div>scene</div>";
      for (const Json& r : recommendations) {
        head += fmt::format("<div>{} of host work</div>", load_text(r.at("host_ms")));
      }
      head += "</div>\n";
    }
    rows += fmt::format(
        "<div><div><b><a href=\"#{0}\">{0}</a></b><small>{1} bodies, {2} contacts, largest island "
        "{3}</small></div>",
        escaped(scene.at("scene")), count(scene.at("bodies")), count(scene.at("contacts")),
        count(scene.at("largest_island")));
    for (const Json& r : recommendations) rows += cell(scene, r);
    rows += "</div>\n";
  }
  if (rows.empty()) return "";
  return fmt::format(
      "<section class=card id=answer><h2 style=\"margin-top:0\">The answer</h2>\n<p>Find the scene "
      "that is most like your game, and the milliseconds that your main thread works per frame "
      "beside physics. Of the modes that hold the frame rate, the one whose input becomes visible "
      "soonest (95th percentile) is filled; outlined ones cannot be told apart from it. A rate is "
      "held if 19 of 20 frames end before the next is due; a mode whose interval reaches to both "
      "sides of that is at its edge.</p>\n"
      "<div class=answer style=\"--loads:{}\">\n{}{}</div></section>\n",
      loads, head, rows);
}

std::string trust(const Json& results) {
  int made = 0, disturbed = 0, counted = 0;
  for (const Json& scene : results.at("scenes")) {
    for (const char* part : {"throughput_repetitions", "frame_repetitions"}) {
      made += scene.at(part).at("made").get<int>();
      disturbed += scene.at(part).at("disturbed").get<int>();
      counted += scene.at(part).at("counted").get<int>();
    }
  }
  std::string out =
      "<section class=card id=trust><h2 style=\"margin-top:0\">How sure is that</h2><ul>\n";
  out += results.at("equal").get<bool>()
             ? "<li><span class=ok>Equal work:</span> every row made the same bits at every step, "
               "proved by state hashes.</li>\n"
             : "<li><span class=bad>A mode made a different state:</span> see its scene. Its "
               "figures do not count.</li>\n";
  out += fmt::format(
      "<li>{} repetitions, the modes in turns within each, so that they share the machine's moods; "
      "{} of them were disturbed by other programs or the hypervisor, {} count.</li>\n",
      made, disturbed, counted);
  out +=
      "<li>Intervals are 95 % bootstrap intervals over repetitions. A ranking is claimed only "
      "where "
      "intervals do not overlap and figures differ by 5 % or more.</li>\n";
  if (!results.at("cut").get<std::string>().empty()) {
    out += fmt::format("<li>To save time: {}.</li>\n", escaped(results.at("cut")));
  }
  if (results.at("interrupted").get<bool>()) {
    out += "<li><span class=bad>Interrupted:</span> complete repetitions are shown.</li>\n";
  }
  return out + "</ul></section>\n";
}

std::string scheduling(const Json& results) {
  if (results.at("scheduling").empty()) return "";
  std::string out =
      "<section class=card id=scheduling><h2 style=\"margin-top:0\">Pure scheduling "
      "cost</h2>\n<p>A "
      "step of an empty world as its caller sees it, and 768 tasks that do nothing (12 stages of "
      "64), "
      "in microseconds, warm. Dedicated threads pay a hand-over to the thread and back.</p>\n"
      "<div class=scroll><table><tr><th>row<th>empty step p50<th>p99<th>768 empty tasks "
      "p50<th>p99</tr>\n";
  for (const Json& row : results.at("scheduling")) {
    const Json& step = row.at("empty_step_us");
    out += fmt::format("<tr><td>{}<td>{}<td>{}", chip(row.at("label"), row_class(row)),
                       readable(step.at("p50")), readable(step.at("p99")));
    const Json& tasks = row.at("empty_tasks_us");
    out += tasks.is_null() ? "<td>–<td>–</tr>\n"
                           : fmt::format("<td>{}<td>{}</tr>\n", readable(tasks.at("p50")),
                                         readable(tasks.at("p99")));
  }
  return out + "</table></div></section>\n";
}

std::string method() {
  return "<section class=card id=method><h2 style=\"margin-top:0\">What was measured</h2><ul>\n"
         "<li><b>Frame time</b>: from the instant a frame was due to its end. Frames are due at "
         "fixed "
         "times whatever the loop does, so a late frame makes the next ones late.</li>\n"
         "<li><b>Input to visible</b>: input comes when a frame is due; the time until the end of "
         "the "
         "first frame that shows a step which began after that.</li>\n"
         "<li><b>Host work</b>: a fixed amount of work on 8 MB of objects, calibrated on the idle "
         "machine; it lasts longer where physics disturbs it.</li>\n"
         "<li><b>Steps</b>: the same scenes stepped back to back. Idle time is the sum over "
         "workers of "
         "the time in a step without work: at barriers, for work, for wake-ups.</li>\n"
         "<li><b>The graph allows</b>: work over the larger of critical path and work per worker, "
         "from "
         "the tasks of serial steps.</li>\n"
         "<li><b>Equal threads</b>: dedicated_thread is main and simulation thread; fork_join and "
         "job_system are main and workers. dedicated_thread_jobs has one busy thread more.</li>\n"
         "<li><b>Holds the rate</b>: at most 1 frame in 50 ends after the next was due.</li>\n"
         "</ul></section>\n";
}

std::string facts(const Json& results) {
  const Json& machine = results.at("machine");
  std::string out =
      "<section class=card id=reproduce><h2 style=\"margin-top:0\">Machine, build, how to "
      "reproduce</h2>\n<table class=facts>\n";
  const auto row = [&](const char* name, const std::string& value) {
    out += fmt::format("<tr><td>{}<td>{}</tr>\n", name, escaped(value));
  };
  row("processor", machine.at("cpu"));
  row("cores", std::to_string(machine.at("cores").get<int>()));
  row("instruction set", machine.at("simd"));
  row("system", machine.at("system"));
  row("compiler", machine.at("compiler"));
  row("flags", machine.at("flags"));
  row("commit", machine.at("commit"));
  row("measured",
      results.at("started").get<std::string>() + ", " + number(results.at("seconds"), 0) + " s");
  return out + fmt::format("</table>\n<pre>{}</pre>\n</section>\n", escaped(results.at("command")));
}

std::string legend(const Json& results) {
  std::string out = "<p class=legend>";
  if (results.at("scenes").empty()) return "";
  for (const Json& row : results.at("scenes")[0].at("throughput")) {
    if (row.at("scheduler") != "own") continue;
    out += fmt::format("<span><i class=\"{}\"></i>{}</span>", row_class(row),
                       escaped(row.at("label")));
  }
  return out + "</p>\n";
}

}  // namespace

std::string html(const Json& results) {
  std::string body;
  const Json& machine = results.at("machine");
  body += fmt::format(
      "<header><h1>Which threading mode for physics?</h1><p class=soft>{}, {} cores · {} · "
      "{}</p></header>\n",
      escaped(machine.at("cpu")), machine.at("cores").get<int>(),
      escaped(results.at("started").get<std::string>().substr(0, 10)),
      escaped(machine.at("commit").get<std::string>()));
  body += answer(results);
  body += trust(results);
  const std::string colours = legend(results);
  for (const Json& scene : results.at("scenes")) body += scene_section(scene, colours);
  body += scheduling(results);
  body += method();
  body += facts(results);
  return fmt::format(
      "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\n<meta name=viewport "
      "content=\"width=device-width,initial-scale=1\">\n<meta name=color-scheme content=\"light "
      "dark\">\n<link rel=icon href=\"data:,\">\n<title>Skerry: which threading mode?</title>\n"
      "<style>{}</style></head>\n<body><main>\n{}</main>\n<script>{}</script></body></html>\n",
      kStyle, body, kScript);
}

}  // namespace skerry::report
