// Public accuracy tasks, the short ones whole: docs/accuracy.md has the table.
#include "apps/measure/accuracy_tasks.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string_view>

namespace skerry::test {
namespace {

const measure::AccuracyTask& task(std::string_view scene, double dt) {
  for (const auto& task : measure::accuracy_tasks()) {
    if (scene == task.scene && dt == task.dt) return task;
  }
  throw std::out_of_range("no such task");
}

double error_of(std::string_view scene, double dt, std::uint64_t steps = 0) {
  return measure::run_accuracy_task(task(scene, dt), SolverKind::soft_step_tgs, steps).error;
}

TEST(AccuracyTasks, a_plate_rolls_its_balls_as_the_closed_form_says) {
  EXPECT_LT(error_of("sim_rolling_xy", 1e-3), 1e-6);
  EXPECT_LT(error_of("sim_rolling_y", 1e-3), 1e-6);
}

TEST(AccuracyTasks, balls_that_bounce_keep_their_energy) {
  EXPECT_LT(error_of("sim_bouncing", 1e-2), 0.2);     // ODE 0.57
  EXPECT_LT(error_of("sim_bouncing", 1e-3), 5.7e-4);  // RaiSim
}

TEST(AccuracyTasks, balls_that_fall_apart_do_not_overlap) {
  EXPECT_LT(error_of("sim_666", 1e-2), 1e-4);  // RaiSim 0.0153
}

TEST(AccuracyTasks, an_elastic_cube_of_balls_keeps_its_energy) {
  EXPECT_LT(error_of("sim_666_elastic", 1e-2), 6.6);    // RaiSim
  EXPECT_LT(error_of("sim_666_elastic", 4e-3), 0.01);   // RaiSim 0.047
  EXPECT_LT(error_of("sim_666_elastic", 1e-3), 0.004);  // RaiSim 0.0084
}

TEST(AccuracyTasks, a_free_box_keeps_its_angular_momentum) {
  EXPECT_LT(error_of("sim_boxes", 1e-3), 1e-12);
}

TEST(AccuracyTasks, a_tower_of_bricks_stands) {
  EXPECT_EQ(error_of("sim_kapla", 1e-2, 3000), 3000);
}

}  // namespace
}  // namespace skerry::test
