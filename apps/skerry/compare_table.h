#pragma once

#include "apps/measure/compare.h"

namespace skerry::app {

// The figures of a scene that fit a terminal, and the verdict, on standard output.
void print_comparison(const measure::SceneComparison& comparison);

}  // namespace skerry::app
