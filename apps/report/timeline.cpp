#include <fmt/core.h>
#include <algorithm>
#include <map>

#include "apps/report/parts.h"

namespace skerry::report {
namespace {

// Tasks of one colour on one track that follow each other this closely are drawn as one.
constexpr double kJoinUs = 15;
constexpr double kTrackHeight = 22, kTrackGap = 5;

struct Box {
  std::size_t track = 0;
  std::string css_class, name;
  double begin_us = 0, end_us = 0;
  int count = 1;
};

std::string class_of(const Json& span) {
  const std::string kind = span[1];
  return kind == "physics" ? stage_class(span[2]) : "k-" + kind;
}

std::vector<Box> boxes_of(const Json& timeline) {
  std::vector<Box> boxes;
  for (const Json& span : timeline.at("spans")) {
    boxes.push_back({span[0], class_of(span), span[2], span[3], span[4]});
  }
  // Waits lie below what the thread did meanwhile.
  std::stable_sort(boxes.begin(), boxes.end(), [](const Box& a, const Box& b) {
    const bool wait_a = a.css_class == "k-wait", wait_b = b.css_class == "k-wait";
    if (wait_a != wait_b) return wait_a;
    return std::pair(a.track, a.begin_us) < std::pair(b.track, b.begin_us);
  });
  std::vector<Box> joined;
  for (const Box& box : boxes) {
    if (!joined.empty()) {
      Box& last = joined.back();
      if (last.track == box.track && last.css_class == box.css_class &&
          box.begin_us - last.end_us < kJoinUs) {
        last.end_us = std::max(last.end_us, box.end_us);
        ++last.count;
        if (last.name != box.name) last.name = "several stages";
        continue;
      }
    }
    joined.push_back(box);
  }
  return joined;
}

std::string draw(const Json& timeline, double scale_us) {
  const auto& tracks = timeline.at("tracks");
  const double height = static_cast<double>(tracks.size()) * (kTrackHeight + kTrackGap);
  const auto x = [&](double us) { return 1000 * std::clamp(us, 0.0, scale_us) / scale_us; };
  std::string out = fmt::format(
      "<svg class=gantt viewBox=\"0 0 1000 {}\" preserveAspectRatio=none style=\"height:{}px\" "
      "role=img aria-label=\"one frame of {}\">\n",
      height, height, escaped(timeline.at("label")));
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    out += fmt::format("<rect class=track x=0 y=\"{}\" width=1000 height=\"{}\"/>\n",
                       static_cast<double>(i) * (kTrackHeight + kTrackGap), kTrackHeight);
  }
  for (const Box& box : boxes_of(timeline)) {
    if (box.end_us <= 0 || box.begin_us >= scale_us) continue;
    out += fmt::format(
        "<rect class=\"{}\" x=\"{:.2f}\" y=\"{}\" width=\"{:.2f}\" height=\"{}\"><title>{}{}: {} "
        "ms</title></rect>\n",
        box.css_class, x(box.begin_us), static_cast<double>(box.track) * (kTrackHeight + kTrackGap),
        std::max(0.4, x(box.end_us) - x(box.begin_us)), kTrackHeight, escaped(box.name),
        box.count > 1 ? fmt::format(" ({} tasks)", box.count) : "",
        readable(1e-3 * (box.end_us - box.begin_us)));
  }
  const double period_us = 1e3 * timeline.at("period_ms").get<double>();
  const double end_us = 1e3 * timeline.at("latency_ms").get<double>();
  out += fmt::format("<line class=deadline x1=\"{0:.2f}\" x2=\"{0:.2f}\" y1=0 y2=\"{1}\"/>",
                     x(period_us), height);
  out += fmt::format("<line class=frame-end x1=\"{0:.2f}\" x2=\"{0:.2f}\" y1=0 y2=\"{1}\"/>",
                     x(end_us), height);
  return out + "</svg>\n";
}

// Short, for the margin: "main", "worker 1", "sim".
std::string short_name(const std::string& track) {
  if (track == "main thread") return "main";
  if (track == "simulation thread") return "sim";
  return track;
}

const std::vector<std::pair<const char*, const char*>>& stage_groups() {
  static const std::vector<std::pair<const char*, const char*>> kGroups = {
      {"s-broad", "bounds and pairs"},
      {"s-narrow", "narrowphase"},
      {"s-islands", "islands"},
      {"s-solve", "solve, finalise, transforms"},
      {"s-rest", "commands, sleep, publish"}};
  return kGroups;
}

}  // namespace

std::string stage_class(const std::string& stage) {
  static const std::map<std::string, std::string> kClasses = {
      {"update_bounds", "s-broad"},   {"refit_broadphase", "s-broad"},
      {"query_pairs", "s-broad"},     {"merge_pairs", "s-broad"},
      {"narrowphase", "s-narrow"},    {"build_islands", "s-islands"},
      {"solve_islands", "s-solve"},   {"finalise_bodies", "s-solve"},
      {"write_transforms", "s-solve"}};
  const auto found = kClasses.find(stage);
  return found != kClasses.end() ? found->second : "s-rest";
}

std::string stage_legend() {
  std::string out = "<p class=legend>";
  for (const auto& [css_class, name] : stage_groups()) {
    out += fmt::format("<span><i class=\"{}\"></i>{}</span>", css_class, name);
  }
  return out + "</p>\n";
}

std::string timelines(const Json& scene) {
  double scale_us = 0;
  for (const Json& timeline : scene.at("timelines")) {
    scale_us = std::max({scale_us, 1.03e3 * timeline.at("period_ms").get<double>(),
                         1.03e3 * timeline.at("latency_ms").get<double>()});
  }
  std::string out;
  for (const Json& timeline : scene.at("timelines")) {
    out += fmt::format(
        "<div class=frame><h4>{} <small>ends after {} ms</small></h4><div class=gantt-row><div "
        "class=tracks>",
        chip_of(scene, timeline.at("label")), number(timeline.at("latency_ms"), 1));
    for (const Json& track : timeline.at("tracks")) {
      out += fmt::format("<div>{}</div>", escaped(short_name(track)));
    }
    out += "</div>" + draw(timeline, scale_us) + "</div></div>\n";
  }
  const double step_ms = scale_us > 40'000 ? 10 : 4;
  out += "<div class=gantt-row><div class=tracks></div><div class=axis>";
  for (double ms = 0; 1e3 * ms <= scale_us; ms += step_ms) {
    out += fmt::format("<span style=\"left:{:.2f}%\">{:g}{}</span>", 1e5 * ms / scale_us, ms,
                       ms == 0 ? " ms" : "");
  }
  out += "</div></div>\n<p class=legend>";
  for (const auto& [css_class, name] :
       std::vector<std::pair<const char*, const char*>>{{"k-host", "host work"},
                                                        {"k-host_job", "host jobs"},
                                                        {"k-wait", "waiting"},
                                                        {"k-show", "reading poses"}}) {
    out += fmt::format("<span><i class=\"{}\"></i>{}</span>", css_class, name);
  }
  for (const auto& [css_class, name] : stage_groups()) {
    out += fmt::format("<span><i class=\"{}\"></i>{}</span>", css_class, name);
  }
  return out + "</p>\n";
}

}  // namespace skerry::report
