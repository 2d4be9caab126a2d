#include <fmt/core.h>
#include <algorithm>
#include <cmath>

#include "apps/report/parts.h"

namespace skerry::report {
namespace {

constexpr double kWidth = 400, kHeight = 250;
constexpr double kLeft = 38, kRight = 12, kTop = 24, kBottom = 38;

double nice_step(double range) {
  const double raw = range / 5;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

class Plot {
 public:
  explicit Plot(const LineChart& chart) : chart_(chart) {
    first_ = last_ =
        chart.series.empty() || chart.series[0].points.empty() ? 0 : chart.series[0].points[0].x;
    top_ = chart.limit;
    for (const Series& series : chart.series) {
      for (const Point& point : series.points) {
        first_ = std::min(first_, point.x);
        last_ = std::max(last_, point.x);
        top_ = std::max({top_, point.y, point.high});
      }
    }
    if (chart.highest > 0) top_ = std::min(top_, chart.highest);
    if (top_ <= 0) top_ = 1;
    if (last_ <= first_) last_ = first_ + 1;
    step_ = nice_step(top_);
    top_ = step_ * std::ceil(top_ / step_ - 1e-9);
  }

  std::string draw() const {
    std::string out = fmt::format(
        "<figure><figcaption>{}</figcaption><svg class=chart viewBox=\"0 0 {} {}\" role=img "
        "aria-label=\"{}\">\n",
        escaped(chart_.title), kWidth, kHeight, escaped(chart_.title));
    out += axes();
    for (const Series& series : chart_.series) out += band(series);
    for (const Series& series : chart_.series) out += line(series);
    return out + "</svg></figure>\n";
  }

 private:
  double px(double x) const {
    return kLeft + (x - first_) / (last_ - first_) * (kWidth - kLeft - kRight);
  }
  double py(double y) const {
    return kHeight - kBottom - std::min(y, top_) / top_ * (kHeight - kTop - kBottom);
  }

  std::string axes() const {
    std::string out;
    for (double y = 0; y <= top_ * 1.001; y += step_) {
      out += fmt::format(
          "<line class=grid x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
          "<text class=tick x=\"{}\" y=\"{:.1f}\" text-anchor=end>{:g}</text>\n",
          kLeft, kWidth - kRight, py(y), py(y), kLeft - 5, py(y) + 4, y);
    }
    out += fmt::format("<text class=tick x=\"2\" y=\"12\">{}</text>\n", escaped(chart_.y_unit));
    if (!chart_.series.empty()) {
      for (const Point& point : chart_.series[0].points) {
        out +=
            fmt::format("<text class=tick x=\"{:.1f}\" y=\"{}\" text-anchor=middle>{:g}</text>\n",
                        px(point.x), kHeight - kBottom + 16, point.x);
      }
    }
    out += fmt::format("<text class=tick x=\"{}\" y=\"{}\" text-anchor=middle>{}</text>\n",
                       (kLeft + kWidth - kRight) / 2, kHeight - 6, escaped(chart_.x_title));
    if (chart_.limit > 0 && chart_.limit <= top_) {
      out += fmt::format(
          "<line class=limit x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
          "<text class=limit-text x=\"{}\" y=\"{:.1f}\">{}</text>\n",
          kLeft, kWidth - kRight, py(chart_.limit), py(chart_.limit), kLeft + 4,
          py(chart_.limit) - 4, escaped(chart_.limit_label));
    }
    return out;
  }

  std::string band(const Series& series) const {
    if (series.points.size() < 2) return "";
    std::string path;
    for (const Point& p : series.points) path += fmt::format("{:.1f},{:.1f} ", px(p.x), py(p.high));
    for (auto p = series.points.rbegin(); p != series.points.rend(); ++p) {
      path += fmt::format("{:.1f},{:.1f} ", px(p->x), py(p->low));
    }
    return fmt::format("<polygon class=\"band {}\" points=\"{}\"/>\n", series.css_class, path);
  }

  std::string line(const Series& series) const {
    std::string path;
    std::string dots;
    for (const Point& p : series.points) {
      path += fmt::format("{:.1f},{:.1f} ", px(p.x), py(p.y));
      dots += fmt::format(
          "<circle class=\"dot {}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.2\"><title>{}: {} "
          "(95 % interval {} to {}) at {:g}</title></circle>",
          series.css_class, px(p.x), py(p.y), escaped(series.label), readable(p.y), readable(p.low),
          readable(p.high), p.x);
    }
    return fmt::format("<polyline class=\"line {}\" points=\"{}\"/>{}\n", series.css_class, path,
                       dots);
  }

  const LineChart& chart_;
  double first_ = 0, last_ = 0, top_ = 0, step_ = 1;
};

}  // namespace

std::string svg(const LineChart& chart) { return Plot(chart).draw(); }

}  // namespace skerry::report
