// Pieces of the page. Text from outside is escaped here and nowhere else.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/report/report.h"

namespace skerry::report {

std::string escaped(const std::string& text);
std::string number(double value, int digits);
std::string count(std::uint64_t value);  // "20,481"
// As many digits as a reader needs: 0.0123, 1.23, 12.3, 123.
std::string readable(double value);

// The colour of a row: by its mode, with other schedulers apart. A CSS class.
std::string row_class(const Json& row);
// "<span class=chip ...>job_system</span>"
std::string chip(const std::string& label, const std::string& css_class);
std::string chip_of(const Json& scene, const std::string& label);

// ---- charts (static SVG; colours and fonts come from the page's style)

struct Point {
  double x = 0, y = 0, low = 0, high = 0;
};
struct Series {
  std::string label;
  std::string css_class;
  std::vector<Point> points;
};
struct LineChart {
  std::string title;
  std::string y_unit;
  std::string x_title;
  std::vector<Series> series;
  double limit = 0;  // a line across; 0: none
  std::string limit_label;
  double highest = 0;  // y is cut here; 0: nowhere
};
std::string svg(const LineChart& chart);

struct Bar {
  std::string label;
  std::string css_class;
  double value = 0, low = 0, high = 0;
  double mark = 0;  // a tick across the bar; 0: none
  std::string text;
};
// Horizontal bars with intervals, as HTML.
std::string bars(const std::vector<Bar>& rows, double least_scale);

struct StackPart {
  std::string name;
  std::string css_class;
  double value = 0;
};
struct Stack {
  std::string label;
  std::vector<StackPart> parts;
  std::string text;
};
std::string stacks(const std::vector<Stack>& rows);

// One frame per mode, all to one scale.
std::string timelines(const Json& scene);
// The CSS class of a stage's colour, and the legend of all.
std::string stage_class(const std::string& stage);
std::string stage_legend();

extern const char* const kStyle;
extern const char* const kScript;

}  // namespace skerry::report
