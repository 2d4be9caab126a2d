// The public face: every call checks what the world is doing and what it was given, then hands over.
#include <skerry/world.h>

#include <algorithm>
#include <utility>

#include <skerry/jobs/parallel_for.h>

#include "pipeline/body_edits.h"
#include "pipeline/edge_checks.h"
#include "pipeline/joint_edits.h"
#include "pipeline/measure.h"
#include "pipeline/property_edits.h"
#include "pipeline/simulation_thread.h"
#include "pipeline/threading_mode.h"
#include "pipeline/world_data.h"
#include "solver/joint_coordinates.h"

namespace skerry {

using pipeline::Activity;
using pipeline::require;
using pipeline::require_idle;

struct World::Impl : pipeline::WorldData {
  explicit Impl(const WorldSettings& world_settings);
  ~Impl();

  // A step in one go, or as begin, the caller's own work, end.
  void make_step(double dt);
  void begin(double dt);
  void end();

  // For the modes that have one.
  std::unique_ptr<pipeline::SimulationThread> thread;
  double thread_dt = 0;  // s, of the steps the thread makes

 private:
  void prepare(double dt);
  void conclude();
};

namespace {

const WorldSettings& checked(const WorldSettings& settings) {
  pipeline::check_settings(settings);
  return settings;
}

// Milliseconds, counts and names from the run, into storage that exists already.
void fill_times(const pipeline::WorldData& world, StepReport& report) {
  const jobs::RunReport& run = world.run;
  report.begin_ns = run.begin_ns;
  report.step_ms = 1e-6 * double(run.end_ns - run.begin_ns);
  report.blocked_ms = 1e-6 * double(run.blocked_ns);
  report.helped_ms = 1e-6 * double(run.helped_ns);
  report.idle_ms =
      report.step_ms * world.executor->worker_count() + 1e-6 * double(run.phase_wait_ns);
  report.stage_count = static_cast<std::uint32_t>(run.stages.size());
  for (std::uint32_t i = 0; i < report.stage_count; ++i) {
    const jobs::StageTiming& stage = run.stages[i];
    report.stage_storage[i] = {stage.name, 1e-6 * double(stage.end_ns - stage.begin_ns),
                               1e-6 * double(stage.busy_ns), stage.tasks,
                               world.graph.follows_per_item(i)};
    report.idle_ms -= report.stage_storage[i].cpu_ms;
  }
}

void fill_counts(const pipeline::WorldData& world, StepReport& report) {
  report.bodies = static_cast<std::uint32_t>(world.ids.size());
  report.awake_bodies = static_cast<std::uint32_t>(world.bodies.awake.size());
  report.shapes =
      static_cast<std::uint32_t>(world.colliders.rows.size() - world.colliders.free_rows.size());
  report.joints =
      static_cast<std::uint32_t>(world.joints.rows.size() - world.joints.free_rows.size());
  report.pairs = static_cast<std::uint32_t>(world.contacts.pairs.size());
  report.contacts = static_cast<std::uint32_t>(world.islands.contacts.size());
  report.islands = static_cast<std::uint32_t>(world.islands.islands.size());
  report.largest_island = 0;
  for (const core::Island& island : world.islands.islands) {
    report.largest_island = std::max(report.largest_island, island.body_count);
  }
  const auto counts = collision::take_counts(*world.narrowphase);
  report.fallback_pairs = counts.fallback_pairs;
  if (counts.fallback_failures > 0) {
    report.warnings.push_back(std::to_string(counts.fallback_failures) +
                              " pairs got no usable answer from the narrowphase fallback");
  }
}

}  // namespace

World::Impl::Impl(const WorldSettings& world_settings) : WorldData(checked(world_settings)) {
  if (!pipeline::has_simulation_thread(settings.mode)) return;
  thread_dt = 1 / settings.rate_hz;
  thread =
      std::make_unique<pipeline::SimulationThread>(settings.rate_hz, settings.block_policy, [this] {
        make_step(thread_dt);
        callback_errors.rethrow();
      });
}

World::Impl::~Impl() {
  thread.reset();
  if (in_flight) {
    try {
      executor->end();
    } catch (...) {  // nobody is left to tell
    }
  }
}

// A run in one go: nobody is invited before there is work for two.
void World::Impl::make_step(double dt) {
  prepare(dt);
  try {
    executor->run(graph, static_cast<pipeline::WorldData*>(this), {.stop = {}, .report = &run});
  } catch (...) {
    queries.end_step(false);
    throw;
  }
  conclude();
}

void World::Impl::begin(double dt) {
  prepare(dt);
  in_flight = true;
  executor->begin(graph, static_cast<pipeline::WorldData*>(this), {.stop = {}, .report = &run});
}

void World::Impl::end() {
  in_flight = false;
  try {
    executor->end();
  } catch (...) {
    queries.end_step(false);
    throw;
  }
  conclude();
}

void World::Impl::prepare(double dt) {
  report.warnings.clear();
  context.dt = dt;
  context.time = time;
  queries.begin_step(*this);
}

void World::Impl::conclude() {
  ++step_count;
  time += context.dt;
  report.step = step_count;
  report.dt = context.dt;
  report.time = time;
  fill_times(*this, report);
  fill_counts(*this, report);
  if (settings.measure_steps) report.measures = pipeline::measure(*this);
  queries.end_step(true);
  if (settings.after_step) settings.after_step(report, run.tasks);
}

World::World(const WorldSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const WorldSettings& World::settings() const { return impl_->settings; }

// -- Bodies -----------------------------------------------------------------------------------------

BodyId World::add_body(const BodyDesc& body) {
  require_idle(*impl_, "add_body");
  return pipeline::add_body(*impl_, body);
}
void World::remove_body(BodyId body) {
  require_idle(*impl_, "remove_body");
  pipeline::remove_body(*impl_, body);
}
bool World::contains(BodyId body) const {
  require_idle(*impl_, "contains");
  return impl_->bodies.alive(body);
}
std::size_t World::body_count() const {
  require_idle(*impl_, "body_count");
  return impl_->bodies.rows() - impl_->bodies.free_rows.size();
}

BodyType World::type(BodyId body) const {
  require_idle(*impl_, "type");
  return pipeline::type_of(*impl_, body);
}
Pose World::pose(BodyId body) const {
  require_idle(*impl_, "pose");
  require(*impl_, body);
  return core::body_frame(impl_->bodies, body.index);
}
Vec3 World::center_of_mass(BodyId body) const {
  require_idle(*impl_, "center_of_mass");
  require(*impl_, body);
  return impl_->bodies.pose[body.index].center;
}
Vec3 World::linear_velocity(BodyId body) const {
  require_idle(*impl_, "linear_velocity");
  require(*impl_, body);
  return impl_->bodies.motion[body.index].linear;
}
Vec3 World::angular_velocity(BodyId body) const {
  require_idle(*impl_, "angular_velocity");
  require(*impl_, body);
  return impl_->bodies.motion[body.index].angular;
}
Vec3 World::angular_momentum(BodyId body) const {
  require_idle(*impl_, "angular_momentum");
  require(*impl_, body);
  return impl_->bodies.motion[body.index].angular_momentum;
}
double World::mass(BodyId body) const {
  require_idle(*impl_, "mass");
  require(*impl_, body);
  return impl_->bodies.mass[body.index].mass;
}
Mat3 World::inertia(BodyId body) const {
  require_idle(*impl_, "inertia");
  require(*impl_, body);
  return impl_->bodies.mass[body.index].inertia_b;
}
bool World::awake(BodyId body) const {
  require_idle(*impl_, "awake");
  require(*impl_, body);
  return impl_->bodies.is(body.index, core::kAwake);
}
std::uint64_t World::user_data(BodyId body) const {
  require_idle(*impl_, "user_data");
  require(*impl_, body);
  return impl_->bodies.user_data[body.index];
}

void World::set_pose(BodyId body, const Pose& pose) {
  require_idle(*impl_, "set_pose");
  pipeline::set_pose(*impl_, body, pose);
}
void World::set_velocity(BodyId body, const Vec3& linear, const Vec3& angular) {
  require_idle(*impl_, "set_velocity");
  pipeline::set_velocity(*impl_, body, linear, angular);
}
void World::move_kinematic(BodyId body, const Pose& target, double dt) {
  require_idle(*impl_, "move_kinematic");
  pipeline::check_time_step(dt);
  pipeline::move_kinematic(*impl_, body, target, dt);
}
void World::apply_force(BodyId body, const Vec3& force, const Vec3& torque) {
  require_idle(*impl_, "apply_force");
  pipeline::apply_force(*impl_, body, force, torque);
}
void World::apply_force_at(BodyId body, const Vec3& force, const Vec3& world_point) {
  require_idle(*impl_, "apply_force_at");
  pipeline::check_finite("world_point", world_point);
  const Vec3 offset = world_point - center_of_mass(body);
  pipeline::apply_force(*impl_, body, force, offset.cross(force));
}
void World::apply_impulse(BodyId body, const Vec3& impulse) {
  require_idle(*impl_, "apply_impulse");
  pipeline::apply_impulse(*impl_, body, impulse, Vec3::Zero());
}
void World::apply_impulse_at(BodyId body, const Vec3& impulse, const Vec3& world_point) {
  require_idle(*impl_, "apply_impulse_at");
  pipeline::apply_impulse(*impl_, body, impulse, world_point - center_of_mass(body));
}
void World::wake(BodyId body) {
  require_idle(*impl_, "wake");
  require(*impl_, body);
  pipeline::wake(*impl_, body.index);
}

// -- What bodies and shapes are ----------------------------------------------------------------------

void World::set_type(BodyId body, BodyType type) {
  require_idle(*impl_, "set_type");
  pipeline::set_type(*impl_, body, type);
}
Filter World::filter(BodyId body, std::uint32_t shape) const {
  require_idle(*impl_, "filter");
  return pipeline::shape_of(*impl_, body, shape).filter;
}
void World::set_filter(BodyId body, std::uint32_t shape, const Filter& filter) {
  require_idle(*impl_, "set_filter");
  pipeline::set_filter(*impl_, body, shape, filter);
}
Material World::material(BodyId body, std::uint32_t shape) const {
  require_idle(*impl_, "material");
  const core::Collider& c = pipeline::shape_of(*impl_, body, shape);
  return {double(c.friction), double(c.restitution), double(c.rolling_resistance)};
}
void World::set_material(BodyId body, std::uint32_t shape, const Material& material) {
  require_idle(*impl_, "set_material");
  pipeline::set_material(*impl_, body, shape, material);
}
bool World::is_sensor(BodyId body, std::uint32_t shape) const {
  require_idle(*impl_, "is_sensor");
  return pipeline::shape_of(*impl_, body, shape).sensor;
}
void World::set_sensor(BodyId body, std::uint32_t shape, bool sensor) {
  require_idle(*impl_, "set_sensor");
  pipeline::set_sensor(*impl_, body, shape, sensor);
}
void World::set_gravity(const Vec3& gravity) {
  require_idle(*impl_, "set_gravity");
  pipeline::set_gravity(*impl_, gravity);
}

// -- Joints and forces ------------------------------------------------------------------------------

JointId World::add_joint(const JointDesc& joint) {
  require_idle(*impl_, "add_joint");
  return pipeline::add_joint(*impl_, joint);
}
void World::remove_joint(JointId joint) {
  require_idle(*impl_, "remove_joint");
  pipeline::remove_joint(*impl_, joint);
}
bool World::contains(JointId joint) const {
  require_idle(*impl_, "contains");
  const auto& rows = impl_->joints.rows;
  return joint.index < rows.size() && rows[joint.index].alive &&
         rows[joint.index].generation == joint.generation;
}
std::size_t World::joint_count() const {
  require_idle(*impl_, "joint_count");
  return impl_->joints.rows.size() - impl_->joints.free_rows.size();
}
double World::joint_position(JointId joint, JointCoordinate coordinate) const {
  require_idle(*impl_, "joint_position");
  require(*impl_, joint);
  return solver::joint_position(impl_->joints.rows[joint.index], impl_->bodies, coordinate);
}
double World::hinge_angle(JointId joint) const {
  return joint_position(joint, JointCoordinate::twist);
}
Vec3 World::joint_force(JointId joint) const {
  require_idle(*impl_, "joint_force");
  require(*impl_, joint);
  return impl_->joints.rows[joint.index].force;
}
Vec3 World::joint_torque(JointId joint) const {
  require_idle(*impl_, "joint_torque");
  require(*impl_, joint);
  return impl_->joints.rows[joint.index].torque;
}
void World::set_joint_limits(JointId joint, JointCoordinate coordinate, const JointLimits& limits) {
  require_idle(*impl_, "set_joint_limits");
  pipeline::set_joint_limits(*impl_, joint, coordinate, limits);
}
void World::set_joint_drive(JointId joint, JointCoordinate coordinate, const JointDrive& drive) {
  require_idle(*impl_, "set_joint_drive");
  pipeline::set_joint_drive(*impl_, joint, coordinate, drive);
}

ForceFieldId World::add_force_field(ForceField field) {
  require_idle(*impl_, "add_force_field");
  if (!field) throw InputError("field", "field: must be callable, got an empty function");
  core::ForceFields& fields = impl_->fields;
  std::uint32_t row = 0;
  while (row < fields.rows.size() && fields.rows[row]) ++row;
  if (row == fields.rows.size()) {
    fields.rows.emplace_back();
    fields.generation.push_back(0);
  }
  fields.rows[row] = std::move(field);
  pipeline::wake_all(*impl_);
  return {row, fields.generation[row]};
}
void World::remove_force_field(ForceFieldId field) {
  require_idle(*impl_, "remove_force_field");
  core::ForceFields& fields = impl_->fields;
  if (field.index >= fields.rows.size() || !fields.rows[field.index] ||
      fields.generation[field.index] != field.generation) {
    throw UsageError("force field " + std::to_string(field.index) + " is not in this world");
  }
  fields.rows[field.index] = nullptr;
  ++fields.generation[field.index];
  pipeline::wake_all(*impl_);
}

// -- Stepping ---------------------------------------------------------------------------------------

namespace {

// However the step ends.
struct IdleAgain {
  explicit IdleAgain(pipeline::WorldData& of) : world(of) {}
  ~IdleAgain() { world.activity = Activity::idle; }
  IdleAgain(const IdleAgain&) = delete;
  IdleAgain& operator=(const IdleAgain&) = delete;
  pipeline::WorldData& world;
};

}  // namespace

StepReport World::step(double dt) {
  require_idle(*impl_, "step");
  pipeline::check_time_step(dt);
  impl_->activity = Activity::stepping;
  {
    const IdleAgain idle_again(*impl_);
    impl_->make_step(dt);
  }
  impl_->callback_errors.rethrow();
  return impl_->report;
}

PendingStep World::begin_step(double dt) {
  require_idle(*impl_, "begin_step");
  pipeline::check_time_step(dt);
  impl_->activity = Activity::stepping;
  try {
    impl_->begin(dt);
  } catch (...) {
    impl_->activity = Activity::idle;
    impl_->in_flight = false;
    impl_->queries.end_step(false);
    throw;
  }
  return PendingStep(impl_->step_count + 1);
}

StepReport World::end_step(PendingStep& pending) {
  if (!impl_->in_flight || pending.step_ != impl_->step_count + 1) {
    throw UsageError("end_step: step " + std::to_string(pending.step_) +
                     " is not in progress; was it ended already?");
  }
  {
    const IdleAgain idle_again(*impl_);
    impl_->end();
  }
  impl_->callback_errors.rethrow();
  return impl_->report;
}

StepReport World::run_steps(std::uint64_t count, double dt) {
  require_idle(*impl_, "run_steps");
  pipeline::check_time_step(dt);
  if (!impl_->thread) {
    for (std::uint64_t i = 0; i < count; ++i) step(dt);
    return impl_->report;
  }
  const double rate_dt = std::exchange(impl_->thread_dt, dt);
  impl_->activity = Activity::stepping;
  const auto restore = [&] {
    impl_->activity = Activity::idle;
    impl_->thread_dt = rate_dt;
  };
  try {
    impl_->thread->run(count);
  } catch (...) {
    restore();
    throw;
  }
  restore();
  return impl_->report;
}

void World::post(Command command) {
  pipeline::check_command(command);
  const std::lock_guard lock(impl_->inbox_mutex);
  impl_->inbox.push_back(std::move(command));
}

// -- Dedicated thread -------------------------------------------------------------------------------

void World::start() {
  require_idle(*impl_, "start");
  if (!impl_->thread) {
    throw UsageError(std::string("start() needs a dedicated_thread mode, this world is ") +
                     to_string(impl_->settings.mode));
  }
  pipeline::refresh_rows(*impl_);
  if (impl_->snapshots.want()) {
    impl_->snapshots.publish(impl_->step_count, impl_->time, impl_->ids, impl_->transforms);
  }
  impl_->queries.want();
  impl_->activity = Activity::running;
  impl_->thread->start(impl_->time);
}

void World::stop() {
  if (impl_->activity != Activity::running) throw UsageError("stop() without start()");
  try {
    impl_->thread->stop();
  } catch (...) {
    impl_->activity = Activity::idle;
    throw;
  }
  impl_->activity = Activity::idle;
}

bool World::running() const { return impl_->activity == Activity::running; }

Snapshot World::latest(SnapshotView view) {
  if (impl_->activity == Activity::running) {
    impl_->thread->wait_for_due();
    return impl_->snapshots.latest(view, impl_->thread_dt, impl_->thread->epoch_ns());
  }
  if (impl_->snapshots.want() && impl_->activity == Activity::idle) {
    pipeline::refresh_rows(*impl_);
    impl_->snapshots.publish(impl_->step_count, impl_->time, impl_->ids, impl_->transforms);
  }
  return impl_->snapshots.latest(view, impl_->context.dt > 0 ? impl_->context.dt : 1, -1);
}

std::uint64_t World::dropped_steps() const { return impl_->thread ? impl_->thread->dropped() : 0; }

// -- Queries ----------------------------------------------------------------------------------------

namespace {

// ask(i) for all i below count, by the world's workers if they are free.
template <class Ask>
void ask_all(pipeline::WorldData& world, std::size_t count, const Ask& ask) {
  constexpr std::uint32_t kChunk = 64;  // some 50 us of rays
  if (count > kChunk) {
    const pipeline::QueryPictures::Turn turn(world.queries);
    if (turn.got_it()) {
      jobs::parallel_for(
          *world.executor, static_cast<std::uint32_t>(count), kChunk,
          [&ask](jobs::IndexRange range, jobs::Task&) {
            for (std::uint32_t i = range.begin; i < range.end; ++i) ask(i);
          },
          "queries");
      return;
    }
  }
  for (std::size_t i = 0; i < count; ++i) ask(i);
}

// The answers of ask(query) to all of a batch.
template <class Query, class Ask>
auto answers(pipeline::WorldData& world, std::span<const Query> batch, const Ask& ask) {
  std::vector<decltype(ask(batch[0]))> all(batch.size());
  ask_all(world, batch.size(), [&](std::size_t i) { all[i] = ask(batch[i]); });
  return all;
}

void check_placed(const PlacedShape& placed) { pipeline::check_query_pose("pose", placed.pose); }

// Checks all of a batch; what is refused is named with its row.
template <class Query>
void check_all(const char* list, std::span<const Query> batch, void (*check)(const Query&)) {
  for (std::size_t i = 0; i < batch.size(); ++i) {
    try {
      check(batch[i]);
    } catch (const InputError& error) {
      const std::string row = std::string(list) + "[" + std::to_string(i) + "].";
      throw InputError(row + error.field(), row + error.what());
    }
  }
}

}  // namespace

QueryView World::queries() const { return QueryView(impl_->queries.newest(*impl_)); }

std::optional<CastHit> World::ray_cast(const RayCast& ray, const QueryFilter& filter) const {
  return queries().ray_cast(ray, filter);
}
std::vector<CastHit> World::ray_cast_all(const RayCast& ray, const QueryFilter& filter) const {
  return queries().ray_cast_all(ray, filter);
}
bool World::ray_hits(const RayCast& ray, const QueryFilter& filter) const {
  return queries().ray_hits(ray, filter);
}
std::optional<CastHit> World::shape_cast(const ShapeCast& cast, const QueryFilter& filter) const {
  return queries().shape_cast(cast, filter);
}
std::vector<CastHit> World::shape_cast_all(const ShapeCast& cast, const QueryFilter& filter) const {
  return queries().shape_cast_all(cast, filter);
}
std::vector<OverlapHit> World::overlap(const QueryShape& shape, const Pose& pose,
                                       const QueryFilter& filter) const {
  return queries().overlap(shape, pose, filter);
}
std::optional<ClosestHit> World::closest(const Vec3& point, double max_distance,
                                         const QueryFilter& filter) const {
  return queries().closest(point, max_distance, filter);
}
std::optional<ClosestHit> World::closest(const QueryShape& shape, const Pose& pose,
                                         double max_distance, const QueryFilter& filter) const {
  return queries().closest(shape, pose, max_distance, filter);
}
std::vector<ClosestHit> World::closest_all(const Vec3& point, double max_distance,
                                           const QueryFilter& filter) const {
  return queries().closest_all(point, max_distance, filter);
}
std::vector<ClosestHit> World::closest_all(const QueryShape& shape, const Pose& pose,
                                           double max_distance, const QueryFilter& filter) const {
  return queries().closest_all(shape, pose, max_distance, filter);
}
std::optional<BodyDistance> World::distance(BodyId a, BodyId b, double max_distance) const {
  return queries().distance(a, b, max_distance);
}

std::vector<std::optional<CastHit>> World::ray_cast_batch(std::span<const RayCast> rays,
                                                          const QueryFilter& filter) const {
  check_all("rays", rays, pipeline::check_ray);
  const QueryView view = queries();
  return answers(*impl_, rays, [&](const RayCast& ray) { return view.ray_cast(ray, filter); });
}
std::vector<std::optional<CastHit>> World::shape_cast_batch(std::span<const ShapeCast> casts,
                                                            const QueryFilter& filter) const {
  check_all("casts", casts, pipeline::check_cast);
  const QueryView view = queries();
  return answers(*impl_, casts,
                 [&](const ShapeCast& cast) { return view.shape_cast(cast, filter); });
}
std::vector<std::vector<OverlapHit>> World::overlap_batch(std::span<const PlacedShape> shapes,
                                                          const QueryFilter& filter) const {
  check_all("shapes", shapes, check_placed);
  const QueryView view = queries();
  return answers(*impl_, shapes, [&](const PlacedShape& placed) {
    return view.overlap(placed.shape, placed.pose, filter);
  });
}
std::vector<std::optional<ClosestHit>> World::closest_batch(std::span<const Vec3> points,
                                                            double max_distance,
                                                            const QueryFilter& filter) const {
  for (std::size_t i = 0; i < points.size(); ++i)
    pipeline::check_query_point("points[" + std::to_string(i) + "]", points[i]);
  pipeline::check_max_distance(max_distance);
  const QueryView view = queries();
  return answers(*impl_, points,
                 [&](const Vec3& point) { return view.closest(point, max_distance, filter); });
}
std::vector<std::optional<ClosestHit>> World::closest_batch(std::span<const PlacedShape> shapes,
                                                            double max_distance,
                                                            const QueryFilter& filter) const {
  check_all("shapes", shapes, check_placed);
  pipeline::check_max_distance(max_distance);
  const QueryView view = queries();
  return answers(*impl_, shapes, [&](const PlacedShape& placed) {
    return view.closest(placed.shape, placed.pose, max_distance, filter);
  });
}

// -- Out --------------------------------------------------------------------------------------------

std::span<const BodyId> World::bodies() const {
  require_idle(*impl_, "bodies");
  pipeline::refresh_rows(*impl_);
  return impl_->ids;
}
std::span<const Pose> World::transforms() const {
  require_idle(*impl_, "transforms");
  pipeline::refresh_rows(*impl_);
  return impl_->transforms;
}
std::span<const std::uint32_t> World::changed() const {
  require_idle(*impl_, "changed");
  pipeline::refresh_rows(*impl_);
  return impl_->changed;
}
std::span<const ContactEvent> World::contact_events() const {
  require_idle(*impl_, "contact_events");
  return impl_->events;
}
std::span<const JointBroken> World::broken_joints() const {
  require_idle(*impl_, "broken_joints");
  return impl_->broken;
}
const StepReport& World::last_report() const {
  require_idle(*impl_, "last_report");
  return impl_->report;
}
std::span<const jobs::TaskRecord> World::last_tasks() const {
  require_idle(*impl_, "last_tasks");
  return impl_->run.tasks;
}
Measures World::measure() const {
  require_idle(*impl_, "measure");
  return pipeline::measure(*impl_);
}
std::uint64_t World::state_hash() const {
  require_idle(*impl_, "state_hash");
  return pipeline::state_hash(*impl_);
}
double World::time() const {
  require_idle(*impl_, "time");
  return impl_->time;
}
std::uint64_t World::step_count() const {
  require_idle(*impl_, "step_count");
  return impl_->step_count;
}

void World::wake_workers() { impl_->executor->wake(); }

}  // namespace skerry
