#include "apps/report/parts.h"

#include <fmt/core.h>
#include <algorithm>
#include <cmath>

namespace skerry::report {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string number(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

std::string count(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, 1, ',');
  return text;
}

std::string readable(double value) {
  const double size = std::abs(value);
  if (size == 0) return "0";
  if (size >= 100) return number(value, 0);
  if (size >= 10) return number(value, 1);
  if (size >= 0.1) return number(value, 2);
  return fmt::format("{:.2g}", value);
}

std::string row_class(const Json& row) {
  if (row.at("scheduler") != "own") return "m-other";
  return "m-" + row.at("mode").get<std::string>();
}

std::string chip(const std::string& label, const std::string& css_class) {
  return fmt::format("<span class=\"chip {}\">{}</span>", css_class, escaped(label));
}

std::string chip_of(const Json& scene, const std::string& label) {
  for (const Json& row : scene.at("throughput")) {
    if (row.at("label") == label) return chip(label, row_class(row));
  }
  return chip(label, "m-other");
}

std::string bars(const std::vector<Bar>& rows, double least_scale) {
  double scale = least_scale;
  for (const Bar& bar : rows) scale = std::max({scale, bar.value, bar.high, bar.mark});
  const auto percent = [&](double value) { return scale > 0 ? 100 * value / scale : 0; };
  std::string out = "<div class=bars>\n";
  for (const Bar& bar : rows) {
    out += fmt::format(
        "<div class=bar-label>{}</div><div class=bar-track><div class=\"bar {}\" "
        "style=\"width:{:.2f}%\"></div>",
        escaped(bar.label), bar.css_class, percent(bar.value));
    if (bar.high > bar.low) {
      out += fmt::format("<div class=whisker style=\"left:{:.2f}%;width:{:.2f}%\"></div>",
                         percent(bar.low), percent(bar.high - bar.low));
    }
    if (bar.mark > 0) {
      out += fmt::format("<div class=mark style=\"left:{:.2f}%\"></div>", percent(bar.mark));
    }
    out += fmt::format("</div><div class=bar-text>{}</div>\n", escaped(bar.text));
  }
  return out + "</div>\n";
}

std::string stacks(const std::vector<Stack>& rows) {
  double scale = 0;
  for (const Stack& stack : rows) {
    double sum = 0;
    for (const StackPart& part : stack.parts) sum += part.value;
    scale = std::max(scale, sum);
  }
  std::string out = "<div class=bars>\n";
  for (const Stack& stack : rows) {
    out += fmt::format("<div class=bar-label>{}</div><div class=\"bar-track stack\">",
                       escaped(stack.label));
    for (const StackPart& part : stack.parts) {
      if (part.value <= 0 || scale <= 0) continue;
      out += fmt::format("<div class=\"bar {}\" style=\"width:{:.2f}%\" title=\"{}: {} ms\"></div>",
                         part.css_class, 100 * part.value / scale, escaped(part.name),
                         readable(part.value));
    }
    out += fmt::format("</div><div class=bar-text>{}</div>\n", escaped(stack.text));
  }
  return out + "</div>\n";
}

}  // namespace skerry::report
