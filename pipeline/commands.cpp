#include "pipeline/commands.h"

#include "pipeline/body_edits.h"
#include "pipeline/property_edits.h"
#include "pipeline/world_data.h"

namespace skerry::pipeline {
namespace {

struct Apply {
  WorldData& world;

  void operator()(const Impulse& c) const {
    require(world, c.body);
    const Vec3 offset =
        c.point ? Vec3(*c.point - world.bodies.pose[c.body.index].center) : Vec3(Vec3::Zero());
    apply_impulse(world, c.body, c.impulse, offset);
  }
  void operator()(const Force& c) const { apply_force(world, c.body, c.force, c.torque); }
  void operator()(const SetVelocity& c) const { set_velocity(world, c.body, c.linear, c.angular); }
  void operator()(const SetPose& c) const { set_pose(world, c.body, c.pose); }
  void operator()(const RemoveBody& c) const { remove_body(world, c.body); }
  void operator()(const SetType& c) const { set_type(world, c.body, c.type); }
  void operator()(const SetFilter& c) const { set_filter(world, c.body, c.shape, c.filter); }
  void operator()(const SetMaterial& c) const { set_material(world, c.body, c.shape, c.material); }
  void operator()(const SetSensor& c) const { set_sensor(world, c.body, c.shape, c.sensor); }
  void operator()(const Spawn& c) const {
    const BodyId body = add_body(world, c.body);
    if (!c.on_added) return;
    try {
      c.on_added(body);
    } catch (...) {
      world.callback_errors.keep(body.index, std::current_exception());
    }
  }
};

}  // namespace

void apply_commands(WorldData& world, jobs::IndexRange, jobs::Task&) {
  {
    const std::lock_guard lock(world.inbox_mutex);
    std::swap(world.inbox, world.applying);
  }
  for (std::size_t i = 0; i < world.applying.size(); ++i) {
    try {
      std::visit(Apply{world}, world.applying[i]);
    } catch (const std::exception& error) {
      world.report.warnings.push_back("command " + std::to_string(i) + " skipped: " + error.what());
    }
  }
  world.applying.clear();
  core::refresh_awake(world.bodies);
  refresh_rows(world);
  world.fast.resize(world.bodies.rows());
}

}  // namespace skerry::pipeline
