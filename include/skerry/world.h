// The engine: bodies, joints and forces in; step; transforms, events and reports out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <skerry/body.h>
#include <skerry/commands.h>
#include <skerry/error.h>
#include <skerry/events.h>
#include <skerry/forces.h>
#include <skerry/ids.h>
#include <skerry/joints.h>
#include <skerry/queries.h>
#include <skerry/settings.h>
#include <skerry/snapshot.h>
#include <skerry/step_report.h>

namespace skerry {

// Proof that a step was begun; give it to end_step().
class PendingStep {
 public:
  PendingStep(PendingStep&&) = default;
  PendingStep& operator=(PendingStep&&) = default;

 private:
  friend class World;
  explicit PendingStep(std::uint64_t step) : step_(step) {}
  std::uint64_t step_;
};

// Owns everything that is simulated. Same calls, same bits: the state after a step depends on the
// calls made and their order, never on mode, workers, compiler or machine.
//
// Threads: one thread at a time may call, and none while a step is in progress, except post() and
// latest(), which any thread may call at any time, and queries (see there). A call at the wrong time
// throws UsageError.
// Errors: bad input throws InputError naming the field and the value; stale ids throw UsageError.
// Either way the world is unchanged.
class World {
 public:
  explicit World(const WorldSettings& settings = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const WorldSettings& settings() const;

  // -- Bodies -------------------------------------------------------------------------------------
  BodyId add_body(const BodyDesc& body);
  void remove_body(BodyId body);  // its joints go with it; "end" events come with the next step
  bool contains(BodyId body) const;
  std::size_t body_count() const;

  BodyType type(BodyId body) const;
  Pose pose(BodyId body) const;              // of the body frame
  Vec3 center_of_mass(BodyId body) const;    // m, world
  Vec3 linear_velocity(BodyId body) const;   // m/s, of the centre of mass
  Vec3 angular_velocity(BodyId body) const;  // rad/s, world
  Vec3 angular_momentum(BodyId body) const;  // kg m^2/s about the centre of mass, world
  double mass(BodyId body) const;            // kg; 0 for fixed and kinematic bodies
  Mat3 inertia(BodyId body) const;           // kg m^2 about the centre of mass, body axes
  bool awake(BodyId body) const;
  std::uint64_t user_data(BodyId body) const;

  void set_pose(BodyId body, const Pose& pose);
  void set_velocity(BodyId body, const Vec3& linear, const Vec3& angular);
  // Moves a kinematic body so that it reaches the pose at the end of a step of dt seconds.
  void move_kinematic(BodyId body, const Pose& target, double dt);
  void apply_force(BodyId body, const Vec3& force, const Vec3& torque = Vec3::Zero());  // next step
  void apply_force_at(BodyId body, const Vec3& force, const Vec3& world_point);         // next step
  void apply_impulse(BodyId body, const Vec3& impulse);                                 // at once
  void apply_impulse_at(BodyId body, const Vec3& impulse, const Vec3& world_point);     // at once
  void wake(BodyId body);

  // -- What bodies and shapes are --------------------------------------------------------------------
  // Each change wakes the body, who touches it and, in the next step, whom it meets by then; pairs of
  // shapes that may not touch any more end with an event in the next step. Shapes by their position
  // in BodyDesc::shapes; one that is not there is refused with InputError.

  // Velocities are kept but by fixed bodies. Dynamic bodies need a mass: that of their solid shapes or
  // of BodyDesc::mass. A mesh that was not added with a dynamic body has none of its own; planes and
  // height fields refuse.
  void set_type(BodyId body, BodyType type);
  Filter filter(BodyId body, std::uint32_t shape) const;
  void set_filter(BodyId body, std::uint32_t shape, const Filter& filter);
  Material material(BodyId body, std::uint32_t shape) const;
  void set_material(BodyId body, std::uint32_t shape, const Material& material);
  bool is_sensor(BodyId body, std::uint32_t shape) const;
  void set_sensor(BodyId body, std::uint32_t shape, bool sensor);  // the body's mass stays as it is
  void set_gravity(const Vec3& gravity);                           // m/s^2; wakes everybody

  // -- Joints and forces --------------------------------------------------------------------------
  JointId add_joint(const JointDesc& joint);
  void remove_joint(JointId joint);
  bool contains(JointId joint) const;
  std::size_t joint_count() const;
  // Where a joint is along a coordinate (b seen from a): m, or rad in (-pi, pi].
  double joint_position(JointId joint, JointCoordinate coordinate) const;
  double hinge_angle(JointId joint) const;  // rad: twist of a hinge
  // Mean load over the last step that its bodies were awake in, by a on b, world: N, and N m about
  // b's anchor. Motors, springs and friction included.
  Vec3 joint_force(JointId joint) const;
  Vec3 joint_torque(JointId joint) const;
  // Change a coordinate that the joint leaves free; its bodies wake. A rod's length is locked.
  void set_joint_limits(JointId joint, JointCoordinate coordinate, const JointLimits& limits);
  void set_joint_drive(JointId joint, JointCoordinate coordinate, const JointDrive& drive);

  ForceFieldId add_force_field(ForceField field);
  void remove_force_field(ForceFieldId field);

  // -- Stepping (all modes but the dedicated-thread ones while started) ----------------------------
  // Advances by dt seconds (> 0, at most 1). Runs the whole step; the caller works too.
  StepReport step(double dt);

  // Begins a step and returns; the caller may do other work. end_step() helps until it is done. In
  // modes without background workers the step is made in end_step().
  PendingStep begin_step(double dt);
  StepReport end_step(PendingStep& pending);

  // Makes `count` steps of dt as fast as possible: on the dedicated thread in the modes that have
  // one (which must not be running), on the caller otherwise. Returns the last step's report.
  StepReport run_steps(std::uint64_t count, double dt);

  // Applied in order at the beginning of the next step. A command whose body has gone by then is
  // skipped and named in StepReport::warnings. Any thread, any time.
  void post(Command command);

  // -- Dedicated thread ---------------------------------------------------------------------------
  void start();  // steps of 1/rate_hz begin; throws UsageError in other modes
  void stop();   // returns when the thread has stopped; then the world may be used directly
  bool running() const;
  // The picture for this frame, under the world's BlockPolicy. In other modes: the last step.
  Snapshot latest(SnapshotView view = SnapshotView::newest);
  std::uint64_t dropped_steps() const;  // steps that BlockPolicy::never left out

  // -- Queries (<skerry/queries.h>) ----------------------------------------------------------------
  // Any number of threads at once, also while a step is pending or the simulation thread runs: then
  // they see the last published step. Not beside calls that edit bodies (add, remove, set_pose).
  // The first query of a world may not come during a step, unless start() began it; from then on a
  // step copies the poses of the bodies it moved, and the first query after it brings the picture up
  // to date.
  QueryView queries() const;  // to ask several questions of one and the same picture

  std::optional<CastHit> ray_cast(const RayCast& ray, const QueryFilter& filter = {}) const;
  std::vector<CastHit> ray_cast_all(const RayCast& ray, const QueryFilter& filter = {}) const;
  bool ray_hits(const RayCast& ray, const QueryFilter& filter = {}) const;
  std::optional<CastHit> shape_cast(const ShapeCast& cast, const QueryFilter& filter = {}) const;
  std::vector<CastHit> shape_cast_all(const ShapeCast& cast, const QueryFilter& filter = {}) const;
  std::vector<OverlapHit> overlap(const QueryShape& shape, const Pose& pose,
                                  const QueryFilter& filter = {}) const;
  std::optional<ClosestHit> closest(const Vec3& point, double max_distance,
                                    const QueryFilter& filter = {}) const;
  std::optional<ClosestHit> closest(const QueryShape& shape, const Pose& pose, double max_distance,
                                    const QueryFilter& filter = {}) const;
  std::vector<ClosestHit> closest_all(const Vec3& point, double max_distance,
                                      const QueryFilter& filter = {}) const;
  std::vector<ClosestHit> closest_all(const QueryShape& shape, const Pose& pose,
                                      double max_distance, const QueryFilter& filter = {}) const;
  std::optional<BodyDistance> distance(BodyId a, BodyId b, double max_distance = 1e15) const;

  // Many at once, by the world's workers, with the results of the single calls; by the caller alone
  // while a step or another batch is under way. Nothing is asked if one of them is refused.
  std::vector<std::optional<CastHit>> ray_cast_batch(std::span<const RayCast> rays,
                                                     const QueryFilter& filter = {}) const;
  std::vector<std::optional<CastHit>> shape_cast_batch(std::span<const ShapeCast> casts,
                                                       const QueryFilter& filter = {}) const;
  std::vector<std::vector<OverlapHit>> overlap_batch(std::span<const PlacedShape> shapes,
                                                     const QueryFilter& filter = {}) const;
  std::vector<std::optional<ClosestHit>> closest_batch(std::span<const Vec3> points,
                                                       double max_distance,
                                                       const QueryFilter& filter = {}) const;
  std::vector<std::optional<ClosestHit>> closest_batch(std::span<const PlacedShape> shapes,
                                                       double max_distance,
                                                       const QueryFilter& filter = {}) const;

  // -- Out ----------------------------------------------------------------------------------------
  // All bodies by ascending index, and their poses in the same order; valid until the next change.
  std::span<const BodyId> bodies() const;
  std::span<const Pose> transforms() const;
  // Rows of the above whose pose changed in the last step.
  std::span<const std::uint32_t> changed() const;
  // Events of the last step, in the order that <skerry/events.h> states; valid until the next step.
  // `persist` events only for touching pairs of awake bodies.
  std::span<const ContactEvent> contact_events() const;

  // Joints that gave way in the last step; they are removed.
  std::span<const JointBroken> broken_joints() const;

  const StepReport& last_report() const;
  std::span<const jobs::TaskRecord> last_tasks() const;  // needs WorldSettings::record_tasks
  Measures measure() const;

  // 64-bit hash of poses, velocities, sleep flags of all bodies and the events of the last step.
  std::uint64_t state_hash() const;
  double time() const;  // s simulated
  std::uint64_t step_count() const;

  // Early wake of sleeping workers; see jobs::Executor::wake.
  void wake_workers();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skerry
