#include "collision/narrowphase.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "collision/box_batch.h"
#include "collision/box_rows.h"
#include "collision/narrowphase_kernels.h"
#include "collision/narrowphase_mesh.h"
#include "collision/narrowphase_pairs.h"
#include "collision/touch_forecast.h"
#include "core/assert.h"
#include "core/rounding.h"

namespace skerry::collision {

using core::ContactPair;
using core::Manifold;

namespace {

// What one worker needs; a cache line apart from the next worker's.
struct alignas(64) WorkerScratch {
  BoxBatch batch;
  BoxBatch single;  // of one pair at another time
  BoxRows box_rows;
  std::array<std::uint32_t, BoxBatch::kSize> rows;  // of the batch, in ContactTable::pairs
  std::array<PairFrame, BoxBatch::kSize> frames;    // of those that go one by one
  int batched = 0;
  std::vector<std::uint32_t> due;  // room for find_due
  MeshScratch mesh;
  std::vector<std::uint32_t> triangles;  // of will_meet
  NarrowphaseCounts counts;
};

}  // namespace

class NarrowphaseScratch {
 public:
  explicit NarrowphaseScratch(std::uint32_t workers) : workers_(workers) {}
  WorkerScratch& worker(std::uint32_t index) {
    SKERRY_ASSERT(index < workers_.size(), "worker index beyond the workers of this scratch");
    return workers_[index];
  }
  std::vector<WorkerScratch>& workers() { return workers_; }

 private:
  std::vector<WorkerScratch> workers_;
};

NarrowphaseScratchPtr make_narrowphase_scratch(std::uint32_t workers) {
  return NarrowphaseScratchPtr(new NarrowphaseScratch(workers));
}
void NarrowphaseScratchDeleter::operator()(NarrowphaseScratch* scratch) const { delete scratch; }

NarrowphaseCounts take_counts(NarrowphaseScratch& scratch) {
  NarrowphaseCounts sum;
  for (WorkerScratch& worker : scratch.workers()) {
    sum.fallback_pairs += worker.counts.fallback_pairs;
    sum.fallback_failures += worker.counts.fallback_failures;
    worker.counts = {};
  }
  return sum;
}

namespace {

using Kernel = void (*)(const PlacedShape& a, const PlacedShape& b, Query& query,
                        ContactPatch& patch);

// Kernels that give one patch; [a][b] for a <= b. Other convex pairs go to convex_convex.
struct KernelTable {
  Kernel at[core::kShapeTypeCount][core::kShapeTypeCount] = {};

  constexpr KernelTable() {
    using enum ShapeType;
    set(sphere, sphere, sphere_sphere);
    set(sphere, capsule, sphere_capsule);
    set(sphere, box, sphere_box);
    set(sphere, hull, sphere_hull);
    set(capsule, capsule, capsule_capsule);
    set(capsule, box, capsule_box);
    set(box, hull, polytope_polytope);
    set(hull, hull, polytope_polytope);
    for (const ShapeType convex : {sphere, capsule, box, cylinder, cone, ellipsoid, hull})
      set(convex, plane, convex_plane);
  }
  constexpr void set(ShapeType a, ShapeType b, Kernel kernel) {
    at[static_cast<int>(a)][static_cast<int>(b)] = kernel;
  }
  Kernel operator()(ShapeType a, ShapeType b) const {
    return at[static_cast<int>(a)][static_cast<int>(b)];
  }
};
constexpr KernelTable kKernels;

bool quarantined(const StepContext& step, const ContactPair& pair) {
  return ((step.bodies->flags[pair.body_a] | step.bodies->flags[pair.body_b]) &
          core::kQuarantined) != 0;
}
bool may_touch(const StepContext& step, const ContactPair& pair) {
  if (quarantined(step, pair)) return false;
  if (pair.flags & core::kSensorPair) return true;
  return ((step.bodies->flags[pair.body_a] | step.bodies->flags[pair.body_b]) & core::kDynamic) !=
         0;
}

// Types ascend.
void collide_placed(PlacedPair& placed, WorkerScratch& scratch, PatchSet& patches) {
  const PlacedShape &a = placed.a, &b = placed.b;
  const ShapeType type_a = a.collider->type, type_b = b.collider->type;
  if (const Kernel kernel = kKernels(type_a, type_b)) {
    patches.count = 1;
    kernel(a, b, placed.query, patches.patch[0]);
  } else if (core::is_surface(type_b)) {
    if (type_a == ShapeType::plane && type_b == ShapeType::mesh)
      plane_mesh(a, b, placed.query, scratch.mesh, patches);
    else if (type_a < ShapeType::plane)
      convex_mesh(a, b, placed.query, scratch.mesh, patches);
  } else if (type_a != ShapeType::plane) {
    patches.count = 1;
    convex_convex(a, b, placed.query, patches.patch[0]);
  }
}

// `collide`: as in TouchForecast::find.
template <class Collide>
void store(const StepContext& step, const ApartPairs& known, ContactPair& pair, PatchSet& patches,
           const V3f& linear, const V3f& angular, float apart, const Collide& collide) {
  float time = 0;
  if (may_bounce(step, pair)) {
    TouchForecast forecast(step, pair, linear, angular);
    if (forecast.expects(patches))
      time = forecast.find(collide, patches, step.contacts->touch_gaps[pair.first_manifold]);
  }
  store_patches(step, pair, patches, linear, angular);
  if (pair.manifold_count == 0)
    known.note(pair, apart);
  else if (time > 0)
    step.contacts->manifolds[pair.first_manifold].touch_time = time;
}

// Types may descend.
void collide_any(const StepContext& step, ContactPair& pair, PlacedPair& placed,
                 WorkerScratch& scratch, PatchSet& patches) {
  if (is_polytope(placed.a) && is_polytope(placed.b))
    placed.query.memory = &step.contacts->polytope_memory[pair.first_manifold];
  const bool swap = placed.a.collider->type > placed.b.collider->type;
  if (swap) placed = swapped(placed);
  collide_placed(placed, scratch, patches);
  if (swap)
    for (std::uint32_t i = 0; i < patches.count; ++i)
      patches.patch[i].normal = -patches.patch[i].normal;
  pair.cache = placed.query.cache;
}

void collide_pair(const StepContext& step, const ApartPairs& known, ContactPair& pair,
                  WorkerScratch& scratch) {
  const PairApproach approach = pair_approach(step, pair);
  const float apart = spheres_apart(step, pair, approach);
  if (apart > approach.margin) {
    clear_contact(pair);
    return known.note(pair, apart);
  }
  PairFrame frame;
  pair_frame(step, pair, approach, frame);
  PlacedPair placed = placed_pair(step, pair, frame);
  PatchSet patches;
  collide_any(step, pair, placed, scratch, patches);
  drop_foreseen(step, pair, frame.touch, frame.linear, frame.angular, scratch.triangles, patches);
  store(step, known, pair, patches, frame.linear, frame.angular, placed.query.apart,
        [&](const PairAt& at, PatchSet& then) {
          PairFrame there;
          pair_frame(step, pair, at, approach.margin, there);
          PlacedPair again = placed_pair(step, pair, at, there);
          collide_any(step, pair, again, scratch, then);
        });
}

// -- Box against box, sixteen pairs at a time.

void put(float (&row)[BoxBatch::kSize], int lane, float value) { row[lane] = value; }

void put(BoxBatch& batch, int first_row, int lane, const V3f& v) {
  put(batch.in[first_row], lane, v.x);
  put(batch.in[first_row + 1], lane, v.y);
  put(batch.in[first_row + 2], lane, v.z);
}
void put(BoxBatch& batch, int first_row, int lane, const core::Q4f& q) {
  put(batch, first_row, lane, V3f{q.x, q.y, q.z});
  put(batch.in[first_row + 3], lane, q.w);
}

// Rows as BoxRows has them.
static_assert(sizeof(core::BodyPose) == 7 * sizeof(double) &&
              offsetof(core::BodyPose, orientation) == 3 * sizeof(double) &&
              offsetof(core::BodyMotion, angular) == 3 * sizeof(double));

void address(const StepContext& step, const ContactPair& pair, BoxRows& rows, int lane) {
  const core::Bodies& bodies = *step.bodies;
  const core::Collider& a = step.colliders->rows[pair.a];
  const core::Collider& b = step.colliders->rows[pair.b];
  rows.pose_a[lane] = bodies.pose[pair.body_a].center.data();
  rows.pose_b[lane] = bodies.pose[pair.body_b].center.data();
  rows.motion_a[lane] = bodies.motion[pair.body_a].linear.data();
  rows.motion_b[lane] = bodies.motion[pair.body_b].linear.data();
  rows.size_a[lane] = &a.size.x;
  rows.size_b[lane] = &b.size.x;
  rows.turn_radius_a[lane] = a.turn_radius;
  rows.turn_radius_b[lane] = b.turn_radius;
}

// The kernel's origin is the centre of box a, not that of its body.
void gather(const StepContext& step, const ContactPair& pair, const PairFrame& frame,
            BoxBatch& batch, int lane) {
  put(batch, BoxBatch::kDx, lane, frame.center_b - frame.center_a);
  put(batch, BoxBatch::kQax, lane, frame.rotation_a);
  put(batch, BoxBatch::kQbx, lane, frame.rotation_b);
  put(batch, BoxBatch::kHax, lane, step.colliders->rows[pair.a].size);
  put(batch, BoxBatch::kHbx, lane, step.colliders->rows[pair.b].size);
  put(batch, BoxBatch::kVx, lane, frame.linear + core::cross(frame.angular, frame.center_a));
  put(batch, BoxBatch::kWx, lane, frame.angular);
  put(batch.in[BoxBatch::kDt], lane, frame.dt);
  put(batch.in[BoxBatch::kSlop], lane, frame.slop);
  put(batch.in[BoxBatch::kMargin], lane, frame.margin);
}

void read(const PairFrame& frame, const BoxBatch& batch, int lane, PatchSet& patches) {
  const auto out = [&](int row) { return batch.out[row][lane]; };
  patches.count = 1;
  ContactPatch& patch = patches.patch[0];
  patch.normal = {out(BoxBatch::kNx), out(BoxBatch::kNy), out(BoxBatch::kNz)};
  patch.count = 0;
  for (int k = 0; k < 4; ++k) {
    const int row = BoxBatch::kPoints + k * BoxBatch::kPointRows;
    const float feature = out(row + BoxBatch::kFeature);
    if (feature < 0) continue;
    const V3f position = {out(row + BoxBatch::kPx), out(row + BoxBatch::kPy),
                          out(row + BoxBatch::kPz)};
    patch.points[patch.count++] = {position + frame.center_a, out(row + BoxBatch::kSeparation),
                                   static_cast<std::uint32_t>(feature)};
  }
}

void scatter(const StepContext& step, const ApartPairs& known, ContactPair& pair,
             const PairFrame& frame, const BoxBatch& batch, int lane, WorkerScratch& scratch) {
  PatchSet patches;
  read(frame, batch, lane, patches);
  drop_foreseen(step, pair, frame.touch, frame.linear, frame.angular, scratch.triangles, patches);
  store(step, known, pair, patches, frame.linear, frame.angular, batch.out[BoxBatch::kApart][lane],
        [&](const PairAt& at, PatchSet& then) {
          BoxBatch& single = scratch.single;
          PairFrame there;
          pair_frame(step, pair, at, batch.in[BoxBatch::kMargin][lane], there);
          gather(step, pair, there, single, 0);
          put(single.in[BoxBatch::kKind], 0, static_cast<float>(pair.cache));
          for (auto& row : single.in) std::fill(row + 1, row + BoxBatch::kSize, row[0]);
          collide_boxes(single, 1);
          pair.cache = static_cast<std::uint32_t>(single.out[BoxBatch::kKindOut][0]);
          read(there, single, 0, then);
        });
}

// Inputs of all lanes, those of a short batch's last ones those of the first. Lanes whose pairs lie as
// their bodies do go together; returns those of them that are not fast.
std::uint32_t gather_batch(const StepContext& step, WorkerScratch& scratch) {
  BoxBatch& batch = scratch.batch;
  const auto pair_of = [&](int lane) -> const ContactPair& {
    return step.contacts->pairs[scratch.rows[lane < scratch.batched ? lane : 0]];
  };
  for (int lane = 0; lane < BoxBatch::kSize; ++lane) {
    address(step, pair_of(lane), scratch.box_rows, lane);
    put(batch.in[BoxBatch::kKind], lane, static_cast<float>(pair_of(lane).cache));
  }
  const bool together = place_boxes(scratch.box_rows, core::rounded_to_float(step.dt), batch);
  std::uint32_t slow = 0;
  for (int lane = 0; lane < scratch.batched; ++lane) {
    const ContactPair& pair = pair_of(lane);
    const bool plain = together && !(pair.flags & core::kSensorPair) && in_place(step, pair);
    if (plain && batch.in[BoxBatch::kMargin][lane] <= kSlowMargin) {
      slow |= 1u << lane;
    } else {
      pair_frame(step, pair, pair_approach(step, pair), scratch.frames[lane]);
      gather(step, pair, scratch.frames[lane], batch, lane);
    }
  }
  return slow;
}

// What scatter needs of the frame of a pair that lies as its bodies do and is not fast.
PairFrame frame_of(const BoxBatch& batch, int lane) {
  const auto in = [&](int row) { return batch.in[row][lane]; };
  PairFrame frame;
  frame.center_a = {0, 0, 0};
  frame.linear = {in(BoxBatch::kVx), in(BoxBatch::kVy), in(BoxBatch::kVz)};
  frame.angular = {in(BoxBatch::kWx), in(BoxBatch::kWy), in(BoxBatch::kWz)};
  frame.touch = kNoTouch;
  return frame;
}

void flush(const StepContext& step, const ApartPairs& known, WorkerScratch& scratch) {
  if (scratch.batched == 0) return;
  const std::uint32_t slow = gather_batch(step, scratch);
  const BoxBatch& batch = scratch.batch;
  collide_boxes(scratch.batch, scratch.batched);
  std::uint32_t lasting = 0;
  float* manifold[BoxBatch::kSize];
  for (int lane = 0; lane < scratch.batched; ++lane) {
    ContactPair& pair = step.contacts->pairs[scratch.rows[lane]];
    pair.cache = static_cast<std::uint32_t>(batch.out[BoxBatch::kKindOut][lane]);
    if (pair.manifold_count != 1 || !(slow >> lane & 1)) continue;
    Manifold& old = step.contacts->manifolds[pair.first_manifold];
    if (old.restitution > 0 || old.touch_time > 0) continue;  // their touch may be foreseen
    lasting |= 1u << lane;
    manifold[lane] = reinterpret_cast<float*>(&old);
  }
  const std::uint32_t stored = store_boxes(batch, lasting, manifold);
  for (int lane = 0; lane < scratch.batched; ++lane) {
    if (stored >> lane & 1) continue;
    ContactPair& pair = step.contacts->pairs[scratch.rows[lane]];
    PairFrame& frame = scratch.frames[lane];
    if (slow >> lane & 1) frame = frame_of(batch, lane);
    scatter(step, known, pair, frame, batch, lane, scratch);
  }
  scratch.batched = 0;
}

void add_to_batch(const StepContext& step, const ApartPairs& known, std::uint32_t row,
                  WorkerScratch& scratch) {
  scratch.rows[scratch.batched++] = row;
  const ContactPair& pair = step.contacts->pairs[row];
  if (pair.flags & core::kTouching) prefetch(step.contacts->manifolds[pair.first_manifold]);
  if (scratch.batched == BoxBatch::kSize) flush(step, known, scratch);
}

// Rows of the pairs that are not known to be apart.
std::span<const std::uint32_t> find_due(const StepContext& step, const ApartPairs& known,
                                        IndexRange active_pairs, std::vector<std::uint32_t>& room) {
  room.resize(std::max<std::size_t>(room.size(), active_pairs.end - active_pairs.begin));
  std::uint32_t* const due = room.data();
  std::size_t count = 0;
  for (std::uint32_t i = active_pairs.begin; i < active_pairs.end; ++i) {
    due[count] = step.contacts->active[i];
    count += known.holds(step.contacts->pairs[due[count]]) ? 0 : 1;
  }
  return {due, count};
}

// Pairs ahead whose data is fetched: what a few of them cost is as long as memory takes.
constexpr std::size_t kAhead = 12;

}  // namespace

void collide_pairs(const StepContext& step, IndexRange active_pairs, Task& task) {
  WorkerScratch& scratch = step.narrowphase->worker(task.worker());
  const ApartPairs known(step);
  const std::span<const std::uint32_t> due = find_due(step, known, active_pairs, scratch.due);
  for (std::size_t i = 0; i < due.size(); ++i) {
    ContactPair& pair = step.contacts->pairs[due[i]];
    if (!may_touch(step, pair)) {
      clear_contact(pair);
      continue;
    }
    if (i + kAhead < due.size()) prefetch_pair(step, step.contacts->pairs[due[i + kAhead]]);
    const ShapeType a = step.colliders->rows[pair.a].type, b = step.colliders->rows[pair.b].type;
    if (a == ShapeType::box && b == ShapeType::box) {
      add_to_batch(step, known, due[i], scratch);
      continue;
    }
    if (!collide_centered_spheres(step, known, pair)) collide_pair(step, known, pair, scratch);
  }
  flush(step, known, scratch);
}

}  // namespace skerry::collision
