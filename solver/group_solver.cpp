#include "solver/group_solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/assert.h"
#include "core/growth.h"
#include "core/rounding.h"
#include "jobs/blocks.h"
#include "solver/effect_watch.h"
#include "solver/fast_watch.h"
#include "solver/forces.h"
#include "solver/free_flight.h"
#include "solver/rotation.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using namespace core;

constexpr std::uint32_t kWideLaneGrain = 128;  // manifolds per task of a wide island: about 1 us
constexpr std::uint32_t kWideBodyGrain = 256;  // rows; a multiple of kMaxWidth
constexpr std::uint32_t kWideJointGrain = 64;  // joints per task
constexpr std::uint32_t kCollectGrain = 1024;  // contacts per task
constexpr std::uint32_t kUnbounded = 0x7fffffff;

// Slower meetings count as resting: what they displace at substep resolution is far below a
// millimetre.
constexpr float kImpactSpeed = 0.05f;  // m/s

// Solving and relaxing once per substep answers slow waves like springs of frequency sqrt(2) / h. A soft
// contact damps them only if it is the weaker of the two: (2 pi contact_hertz h)^2 / 2 = 0.6
// (docs/decisions/0007).
constexpr double kStiffest = 0.175;  // contact_hertz times h

// Time in which contacts come to carry a load: so slowly that it feeds no wave.
constexpr double kCarryTime = 1.5;  // s

// Loads of statics are shared anew in an island whose bodies all move slower than kImpactSpeed while some
// contact has pressed for so long since they were.
constexpr float kRestTime = 0.25f;  // s

// It gives way to this force per effective mass at most, and carries the rest rigidly: until a load
// many times the body's weight has become the usual one, the body must sink in by no more than this
// over (2 pi contact_hertz)^2. The lowest contacts of a pyramid of 100 rows reach 1000 m/s^2, of which they
// come to carry half at least.
constexpr double kSoftLoad = 800;  // m/s^2

// An impact reaches bodies that are this many contacts away or more, by what strikes them and by what
// they pass on (docs/decisions/0024).
constexpr int kStrikePasses = 4, kReflectPasses = 8, kPartPasses = 4;

// Mass ratio of a body and what it rests on from which joints no longer answer contacts: these then
// carry the load that joints would take from them (docs/decisions/0012).
constexpr double kJointsYield = 8;

// A ball is flat over a hundredth of its radius where it touches, and pressed there as Hertz says: friction
// about the normal has a mean lever of 3 pi / 16 of that (docs/decisions/0026). Of the ball inside a shape.
constexpr float kPatchLever = 0.01f * 0.589f;

// See effort_of.
constexpr double kHeavyOnLight = 4;   // mass ratio from which a contact counts
constexpr double kRestsOn = 0.3;      // cosine of the normal and gravity
constexpr double kRatioPerPass = 32;  // mass ratio
constexpr std::uint8_t kMostEffort = 5;
constexpr std::uint64_t kEffortBudget = 8192;  // contacts times passes of an island

template <class T>
void grow(std::vector<T>& v, std::size_t count) {
  if (v.size() < count) v.resize(std::max(count, v.size() + v.size() / 2));
}

Softness soft(double hertz, double damping_ratio, double h) {
  const double omega = 2 * std::numbers::pi * hertz;
  const double a1 = 2 * damping_ratio + h * omega;
  const double a2 = h * omega * a1;
  const double a3 = 1 / (1 + a2);
  return {core::rounded_to_float(omega / a1), core::rounded_to_float(a2 * a3),
          core::rounded_to_float(a3)};
}

constexpr float kTouch = 1e-5f;  // m: a smaller gap counts as none where bodies bounce
constexpr double kSlow = 8;      // what gravity gives in so many steps is slow for an impact
constexpr float kDeep = 1e-3f;   // m: what overlaps by more is pushed apart before it flies

// Contacts and bodies ahead of the present one whose rows are asked for.
constexpr std::uint32_t kPrefetch = 8;

// All lines of a row that will be read soon.
template <class T>
void prefetch(const T& row) {
  const auto* bytes = reinterpret_cast<const char*>(&row);
  for (std::size_t i = 0; i < sizeof(T); i += 64) __builtin_prefetch(bytes + i);
}

const Manifold& empty_manifold() {
  static const Manifold empty = [] {
    Manifold m{};
    m.normal = {0, 1, 0};
    return m;
  }();
  return empty;
}

// m: of the point that is nearest to touching.
float gap_of(const Manifold& manifold) {
  float gap = manifold.points[0].separation;
  for (std::uint32_t k = 1; k < manifold.point_count; ++k)
    gap = std::min(gap, manifold.points[k].separation);
  return gap;
}

// Inlined: what is returned through memory is read back in other pieces, and waited for.
[[gnu::always_inline]] inline Sym3f rounded(const Mat3& m) {
  return {core::rounded_to_float(m(0, 0)), core::rounded_to_float(m(0, 1)),
          core::rounded_to_float(m(0, 2)), core::rounded_to_float(m(1, 1)),
          core::rounded_to_float(m(1, 2)), core::rounded_to_float(m(2, 2))};
}

bool is_finite(const Vec3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

// Takes over a body's new state, or sets the body aside if it is not finite.
void accept(Bodies& bodies, BodyIndex index, const BodyPose& pose, const BodyMotion& motion) {
  if (is_finite(pose.center) && pose.orientation.coeffs().allFinite() && is_finite(motion.linear) &&
      is_finite(motion.angular) && is_finite(motion.angular_momentum)) {
    bodies.pose[index] = pose;
    bodies.motion[index] = motion;
  } else {
    bodies.motion[index] = BodyMotion{};
    bodies.flags[index] |= kQuarantined;
  }
}

// Of a quaternion that is a unit one but for what a step's rounding and a small turn add. To third order,
// which is below rounding, without a root and a division.
Quat made_unit(Quat q) {
  const double excess = q.squaredNorm() - 1;
  if (std::fabs(excess) > 1e-5) return q.normalized();
  q.coeffs() *= 1 - 0.5 * excess + 0.375 * excess * excess;
  return q;
}

// Clears the components along locked axes; `first_lock` is kLockX or kLockRx.
Vec3 unlocked(Vec3 v, std::uint32_t flags, std::uint32_t first_lock) {
  for (int k = 0; k < 3; ++k) {
    if (flags & (first_lock << k)) v[k] = 0;
  }
  return v;
}

}  // namespace

void GroupSolver::begin(const StepContext& step, const IslandGroup& group,
                        const ContactKernels& kernels, jobs::Task& task) {
  step_ = &step;
  group_ = group;
  kernels_ = &kernels;
  const bool wide = group.kind == GroupKind::wide;
  block_grain_ = wide ? kWideLaneGrain / kernels.width : kUnbounded;
  body_grain_ = wide ? kWideBodyGrain : kUnbounded - kMaxWidth + 1;
  assign_rows();
  collect(task);
  set_efforts();
  set_standing_loads();
  set_constants();
  set_impact_times();
  colouring_.run(row_a_.data(), row_b_.data(), contact_count_, pass_.dynamic_end);
  bucket_contacts();
  make_chunks();
  list_phases();
}

void GroupSolver::assign_rows() {
  const Islands& islands = *step_->islands;
  const Island& first = islands.islands[group_.first];
  const Island& last = islands.islands[group_.first + group_.count - 1];
  first_body_ = first.first_body;
  body_count_ = last.first_body + last.body_count - first_body_;
  row_count_ = 1 + body_count_;
  core::make_room(body_, row_count_);
  body_.resize(row_count_);
  body_[0] = kNone;
  has_locks_ = has_reloaded_ = false;
  double lightest = 1e300, heaviest = 0;
  for (std::uint32_t row = 1; row < row_count_; ++row) {
    body_[row] = islands.bodies[first_body_ + row - 1];
    const std::uint32_t flags = step_->bodies->flags[body_[row]];
    has_locks_ = has_locks_ || (flags & kLockMask) != 0;
    has_reloaded_ = has_reloaded_ || (flags & kReloaded) != 0;
    const double mass = step_->bodies->mass[body_[row]].mass;
    lightest = std::min(lightest, mass);
    heaviest = std::max(heaviest, mass);
  }
  unequal_masses_ = heaviest >= kHeavyOnLight * lightest;
  for (const std::uint32_t kinematic : used_kinematics_) kinematic_row_[kinematic] = 0;
  used_kinematics_.clear();
  grow(kinematic_row_, step_->solver->islands.kinematics.size());
}

std::uint32_t GroupSolver::row_of(BodyIndex body) {
  const std::uint32_t slot = body == kNone ? kNone : step_->solver->islands.slot[body];
  const std::uint32_t row = row_in(slot);
  return row == kNone ? seat(slot & ~kKinematicSlot, body) : row;
}

// Dynamic bodies of the group have their rows already; a kinematic one gets its row when it is
// first met (kNone until then); all others share row 0.
std::uint32_t GroupSolver::row_in(std::uint32_t slot) const {
  if (slot == kNone) return 0;
  if (!(slot & kKinematicSlot)) {
    SKERRY_ASSERT(slot - first_body_ < body_count_, "a contact or joint leaves its island");
    return slot - first_body_ + 1;
  }
  const std::uint32_t row = kinematic_row_[slot & ~kKinematicSlot];
  return row == 0 ? kNone : row;
}

std::uint32_t GroupSolver::seat(std::uint32_t kinematic, BodyIndex body) {
  kinematic_row_[kinematic] = row_count_++;
  used_kinematics_.push_back(kinematic);
  body_.push_back(body);
  return kinematic_row_[kinematic];
}

void GroupSolver::collect(jobs::Task& task) {
  const Islands& islands = *step_->islands;
  const Island& first = islands.islands[group_.first];
  const Island& last = islands.islands[group_.first + group_.count - 1];
  first_contact_ = first.first_contact;
  contact_count_ = last.first_contact + last.contact_count - first_contact_;
  grow(contacts_, contact_count_);
  grow(row_a_, contact_count_);
  grow(row_b_, contact_count_);
  bounces_.store(false, std::memory_order_relaxed);
  has_bounces_.store(false, std::memory_order_relaxed);
  has_placed_.store(false, std::memory_order_relaxed);
  has_unsettled_.store(false, std::memory_order_relaxed);
  meets_kinematics_.store(false, std::memory_order_relaxed);
  const std::uint32_t grain = group_.kind == GroupKind::wide ? kCollectGrain : kUnbounded;
  jobs::run_blocks(task, contact_count_ == 0 ? 0 : (contact_count_ - 1) / grain + 1,
                   [&](std::uint32_t block, std::uint32_t) {
                     const std::uint32_t begin = block * grain;
                     collect_contacts(begin, begin + std::min(grain, contact_count_ - begin));
                   });
  if (meets_kinematics_.load(std::memory_order_relaxed)) seat_kinematics();
  joints_.collect(*step_, group_.first, group_.count,
                  [this](BodyIndex body) { return row_of(body); });
}

void GroupSolver::collect_contacts(std::uint32_t begin, std::uint32_t end) {
  const ContactTable& table = *step_->contacts;
  const ContactRef* refs = step_->islands->contacts.data() + first_contact_;
  const std::uint32_t* slots = step_->solver->islands.slot.data();
  bool bounces = false, placed = false, unsettled = false, kinematics = false;
  for (std::uint32_t i = begin; i < end; ++i) {
    const ContactRef ahead = refs[std::min(i + kPrefetch, contact_count_ - 1)];
    prefetch(table.manifolds[ahead.manifold]);
    prefetch(table.pairs[ahead.pair]);
    const ContactPair& pair = table.pairs[refs[i].pair];
    const Manifold& manifold = table.manifolds[refs[i].manifold];
    const std::uint32_t slot_a = slots[pair.body_a], slot_b = slots[pair.body_b];
    row_a_[i] = row_in(slot_a);
    row_b_[i] = row_in(slot_b);
    const Vec3 offset = center_in(slot_b, pair.body_b) - center_in(slot_a, pair.body_a);
    contacts_[i] = {{offset.x(), offset.y(), offset.z()},
                    refs[i].manifold,
                    kind_of(manifold, row_a_[i], row_b_[i]),
                    0,
                    is_loose(manifold)};
    bounces = bounces || manifold.restitution > 0;
    placed = placed || manifold.begins;
    unsettled = unsettled || is_unsettled(manifold);
    kinematics = kinematics || row_a_[i] == kNone || row_b_[i] == kNone;
  }
  if (bounces) has_bounces_.store(true, std::memory_order_relaxed);
  if (placed) has_placed_.store(true, std::memory_order_relaxed);
  if (unsettled) has_unsettled_.store(true, std::memory_order_relaxed);
  if (kinematics) meets_kinematics_.store(true, std::memory_order_relaxed);
}

void GroupSolver::seat_kinematics() {
  const ContactRef* refs = step_->islands->contacts.data() + first_contact_;
  for (std::uint32_t i = 0; i < contact_count_; ++i) {
    const ContactPair& pair = step_->contacts->pairs[refs[i].pair];
    if (row_a_[i] == kNone) row_a_[i] = row_of(pair.body_a);
    if (row_b_[i] == kNone) row_b_[i] = row_of(pair.body_b);
  }
}

// Impacts among several bodies of an island all happen when the first of them does.
void GroupSolver::set_impact_times() {
  core::refill(held_, row_count_, std::uint8_t{0});
  if (!has_bounces_.load(std::memory_order_relaxed) || !joints_.empty()) return;
  find_held();
  core::refill(impact_time_, row_count_, 0.0f);
  std::uint32_t contact = 0, row = 1;
  for (std::uint32_t i = 0; i < group_.count; ++i) {
    const Island& island = step_->islands->islands[group_.first + i];
    const float time = first_impact(contact, contact + island.contact_count);
    std::fill_n(impact_time_.begin() + row, island.body_count, time);
    contact += island.contact_count;
    row += island.body_count;
  }
}

// Bodies under a force that contacts withstood in the last step, or that overlap with others and come on no
// faster than forces make them: substeps move them, and their contacts have no time of their own.
void GroupSolver::find_held() {
  const auto slow = core::rounded_to_float(kSlow * step_->settings->gravity.norm() * step_->dt);
  for (std::uint32_t i = 0; i < contact_count_; ++i) {
    const Manifold& manifold = step_->contacts->manifolds[contacts_[i].manifold];
    const std::uint32_t a = row_a_[i], b = row_b_[i];
    const float* n = manifold.normal_impulse;
    const bool pushed = (n[0] + n[1]) + (n[2] + n[3]) > 0;
    const bool pressed = gap_of(manifold) < -kDeep && manifold.approach_speed < slow;
    if ((pushed || pressed) && (is_forced(a) || is_forced(b))) held_[a] = held_[b] = 1;
  }
}

bool GroupSolver::is_forced(std::uint32_t row) const {
  if (row - 1 >= body_count_) return false;
  const BodyIndex body = body_[row];
  return (step_->bodies->flags[body] & kForced) != 0 ||
         (step_->bodies->mass[body].gravity_scale != 0 && !step_->settings->gravity.isZero(0));
}

// s: when the first of these contacts bounces.
float GroupSolver::first_impact(std::uint32_t begin, std::uint32_t end) const {
  float first = core::rounded_to_float(step_->dt);
  bool any = false;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Manifold& manifold = step_->contacts->manifolds[contacts_[i].manifold];
    const bool fast = manifold.approach_speed > pass_.restitution_threshold;
    if (!(manifold.restitution > 0) || !(fast || manifold.touch_time > 0)) continue;
    const float gap = std::max(gap_of(manifold), 0.0f);
    const float time =
        manifold.touch_time > 0 ? manifold.touch_time : gap / manifold.approach_speed;
    first = std::min(first, time);
    any = true;
  }
  return any ? first : 0;
}

void GroupSolver::set_efforts() {
  efforts_ = 1;
  yields_.clear();
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < group_.count; ++i) {
    const std::uint32_t end = begin + step_->islands->islands[group_.first + i].contact_count;
    const double ratio = unequal_masses_ ? heavy_on_light(begin, end) : 0;
    const std::uint8_t effort = effort_of(ratio, end - begin);
    yields_.push_back(ratio > kJointsYield);
    for (std::uint32_t k = begin; effort > 0 && k < end; ++k) contacts_[k].effort = effort;
    efforts_ = std::max(efforts_, effort + 1u);
    begin = end;
  }
}

// What was put on each other in this step begins with the loads of statics, and what has come to rest goes
// on with them, joints aside.
void GroupSolver::set_standing_loads() {
  const bool any = has_reloaded_ || has_placed_.load(std::memory_order_relaxed) ||
                   has_unsettled_.load(std::memory_order_relaxed);
  if (!any || !(step_->settings->gravity.norm() > 0)) return;
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < group_.count; ++i) {
    const Island& island = step_->islands->islands[group_.first + i];
    if (island.joint_count == 0) share_loads(island, begin);
    begin += island.contact_count;
  }
}

void GroupSolver::share_loads(const Island& island, std::uint32_t begin) {
  const std::uint32_t end = begin + island.contact_count;
  const auto manifold = [&](std::uint32_t k) -> Manifold& {
    return step_->contacts->manifolds[contacts_[k].manifold];
  };
  bool begins = false, unsettled = false;
  for (std::uint32_t k = begin; k < end; ++k) {
    begins = begins || manifold(k).begins;
    unsettled = unsettled || is_unsettled(manifold(k));
  }
  const bool reloaded = is_reloaded(island);
  if (!begins && !unsettled && !reloaded) return;
  const bool all = is_slow(island) && is_plain(island, begin);
  if (!begins && !all) return;
  using Scope = StandingLoads::Scope;
  const double h = step_->dt / step_->settings->solver.substeps;
  standing_loads_.begin(row_count_, step_->settings->gravity, h,
                        !all                 ? Scope::begun
                        : begins || reloaded ? Scope::all_anew
                                             : Scope::all);
  add_standing_bodies(island);
  for (std::uint32_t k = begin; k < end; ++k) add_support(k);
  standing_loads_.share();
  if (!all) return;
  for (std::uint32_t k = begin; k < end; ++k) {
    Manifold& m = manifold(k);
    m.settled = m.standing_impulse > 0 || m.pressed_time > 0;
  }
}

// Whether statics is to be trusted: all contacts were placed, or each body rests on one other.
bool GroupSolver::is_plain(const Island& island, std::uint32_t begin) const {
  std::uint32_t pressed = 0;
  bool placed = true;
  for (std::uint32_t k = begin; k < begin + island.contact_count; ++k) {
    const Manifold& manifold = step_->contacts->manifolds[contacts_[k].manifold];
    if (!manifold.begins && !(manifold.pressed_time > 0)) continue;
    placed = placed && manifold.placed;
    ++pressed;
  }
  return placed || pressed <= island.body_count;
}

bool GroupSolver::is_unsettled(const Manifold& manifold) {
  return !manifold.settled && manifold.pressed_time >= kRestTime;
}

bool GroupSolver::is_reloaded(const Island& island) const {
  if (!has_reloaded_) return false;
  for (std::uint32_t k = 0; k < island.body_count; ++k) {
    if (step_->bodies->is(step_->islands->bodies[island.first_body + k], kReloaded)) return true;
  }
  return false;
}

bool GroupSolver::is_slow(const Island& island) const {
  const Bodies& bodies = *step_->bodies;
  for (std::uint32_t k = 0; k < island.body_count; ++k) {
    const BodyIndex body = step_->islands->bodies[island.first_body + k];
    const BodyMotion& motion = bodies.motion[body];
    const double radius = bodies.mass[body].radius;
    if (motion.linear.squaredNorm() + radius * radius * motion.angular.squaredNorm() >
        double(kImpactSpeed) * double(kImpactSpeed))
      return false;
  }
  return true;
}

void GroupSolver::add_standing_bodies(const Island& island) {
  const Bodies& bodies = *step_->bodies;
  const double gravity = step_->settings->gravity.norm();
  for (std::uint32_t k = 0; k < island.body_count; ++k) {
    const std::uint32_t row = island.first_body + k - first_body_ + 1;
    const core::BodyMass& mass = bodies.mass[body_[row]];
    standing_loads_.add_body(row, mass.mass * mass.gravity_scale * gravity);
  }
}

// Locks bear what they are given.
void GroupSolver::add_support(std::uint32_t index) {
  const Bodies& bodies = *step_->bodies;
  const Vec3& gravity = step_->settings->gravity;
  Manifold& manifold = step_->contacts->manifolds[contacts_[index].manifold];
  const double down = gravity.dot(to_double(manifold.normal));  // positive: b lies below a
  if (std::abs(down) <= kRestsOn * gravity.norm()) return;
  const bool a_rests = down > 0;
  const std::uint32_t above = a_rests ? row_a_[index] : row_b_[index];
  const std::uint32_t below = a_rests ? row_b_[index] : row_a_[index];
  if (above - 1 >= body_count_ || (bodies.flags[body_[above]] & kLockMask) != 0) return;
  const bool yields = below - 1 < body_count_ && (bodies.flags[body_[below]] & kLockMask) == 0;
  const double* o = contacts_[index].offset;
  const Vec3 from_a = Vec3::Zero(), from_b = -Vec3(o[0], o[1], o[2]);
  standing_loads_.add({above,
                       yields ? below : StandingLoads::kGround,
                       &manifold,
                       {a_rests ? from_a : from_b, a_rests ? from_b : from_a}});
}

// How many times heavier than the lightest the heaviest of those bodies is that rest on a lighter one;
// 0: none does.
double GroupSolver::heavy_on_light(std::uint32_t begin, std::uint32_t end) const {
  const Bodies& bodies = *step_->bodies;
  const Vec3& gravity = step_->settings->gravity;
  double heaviest = 0, lightest = 1e300;
  for (std::uint32_t i = begin; i < end; ++i) {
    if (row_a_[i] - 1 >= body_count_ || row_b_[i] - 1 >= body_count_) continue;
    const double a = bodies.mass[body_[row_a_[i]]].mass, b = bodies.mass[body_[row_b_[i]]].mass;
    if (a < kHeavyOnLight * b && b < kHeavyOnLight * a) continue;
    const V3f normal = step_->contacts->manifolds[contacts_[i].manifold].normal;
    const double down = gravity.dot(to_double(normal));  // positive: b lies below a
    if ((a > b ? down : -down) <= kRestsOn * gravity.norm()) continue;
    heaviest = std::max(heaviest, std::max(a, b));
    lightest = std::min(lightest, std::min(a, b));
  }
  return heaviest / lightest;
}

// Where a heavy body rests on a light one, a pass carries no more than the light one's share of the
// load, and warm starting builds it up only over (mass ratio) passes: meanwhile the heavy body sinks
// by about g h^2 times that. More passes, for that island alone, keep this small.
std::uint8_t GroupSolver::effort_of(double ratio, std::uint32_t contacts) {
  std::uint8_t effort = 0;
  while (effort < kMostEffort && ratio > kRatioPerPass * (1 << effort) &&
         (std::uint64_t{contacts} << (effort + 1)) <= kEffortBudget) {
    ++effort;
  }
  return effort;
}

// Whether some of its four points were free at the end of the last step.
bool GroupSolver::is_loose(const Manifold& manifold) {
  const float* impulse = manifold.normal_impulse;
  return manifold.point_count < 4 ||
         std::min(std::min(impulse[0], impulse[1]), std::min(impulse[2], impulse[3])) <= 0;
}

ContactKind GroupSolver::kind_of(const Manifold& manifold, std::uint32_t row_a,
                                 std::uint32_t row_b) const {
  const auto locked = [this](std::uint32_t row) {
    return row - 1 < body_count_ && (step_->bodies->flags[body_[row]] & kLockMask) != 0;
  };
  const bool full = manifold.restitution > 0 || manifold.rolling_resistance > 0 ||
                    (has_locks_ && (locked(row_a) || locked(row_b)));
  const bool one = manifold.point_count <= 1;
  if (full) return one ? ContactKind::point1_full : ContactKind::points4_full;
  return one ? ContactKind::point1 : ContactKind::points4;
}

const Vec3& GroupSolver::center_in(std::uint32_t slot, BodyIndex body) const {
  return slot != kNone && slot & kKinematicSlot
             ? step_->solver->islands.kinematics[slot & ~kKinematicSlot].center
             : step_->bodies->pose[body].center;
}

void GroupSolver::set_constants() {
  padded_rows_ = (row_count_ + kMaxWidth - 1) / kMaxWidth * kMaxWidth;
  grow(velocity_, padded_rows_);
  grow(start_, padded_rows_);
  grow(forced_, padded_rows_);
  grow(delta_, padded_rows_);
  grow(mass_, padded_rows_);
  grow(base_, padded_rows_);
  grow(spin_, padded_rows_);
  grow(ledger_, row_count_);
  grow(outlook_, row_count_);
  joints_.begin(first_body_, row_count_, 1 + body_count_,
                group_.kind == GroupKind::wide ? kWideJointGrain : kUnbounded, yields_);
  joints_.bodies.bind(velocity_.data(), delta_.data());
  const SolverSettings& settings = step_->settings->solver;
  const double h = step_->dt / settings.substeps;
  pass_.velocity = velocity_.data();
  pass_.start = start_.data();
  pass_.forced = forced_.data();
  pass_.delta = delta_.data();
  if (has_bounces_.load(std::memory_order_relaxed)) {
    grow(flown_, padded_rows_);
    grow(flown_from_, row_count_);
  }
  pass_.flown = flown_.data();
  pass_.mass = mass_.data();
  pass_.base = base_.data();
  pass_.spin = spin_.data();
  pass_.dynamic_end = 1 + body_count_;
  pass_.substep = core::rounded_to_float(h);
  pass_.substeps = static_cast<float>(settings.substeps);
  pass_.inv_substep = core::rounded_to_float(1 / h);
  pass_.max_push = core::rounded_to_float(settings.max_push_velocity);
  pass_.restitution_threshold = core::rounded_to_float(settings.restitution_threshold);
  const double hertz = std::min(settings.contact_hertz, kStiffest / h);
  pass_.soft_load = core::rounded_to_float(kSoftLoad * h);
  pass_.soft = soft(hertz, settings.contact_damping_ratio, h);
  const double omega = 2 * std::numbers::pi * hertz;
  pass_.deflection = core::rounded_to_float(std::min(1 / (h * omega * omega), 1e30));
  carry_part_ = core::rounded_to_float(std::min(1.0, step_->dt / kCarryTime));
  unbooked_pass_ = pass_;
  unbooked_pass_.books = false;
  last_pass_ = pass_;
  last_pass_.last = true;
}

// Counting sort by (effort, colour, kind, loose), stable, each kind padded to whole blocks.
void GroupSolver::bucket_contacts() {
  const std::uint32_t width = kernels_->width;
  const std::size_t kinds = std::size_t{efforts_} * colouring_.colours * kContactKinds;
  core::refill(bucket_, 2 * kinds, 0u);
  const auto key = [this](std::uint32_t contact) {
    const Contact& c = contacts_[contact];
    const std::uint32_t kind =
        (c.effort * colouring_.colours + colouring_.colour[contact]) * kContactKinds +
        static_cast<std::uint32_t>(c.kind);
    return 2 * kind + (c.loose ? 1 : 0);
  };
  for (std::uint32_t i = 0; i < contact_count_; ++i) ++bucket_[key(i)];
  std::uint32_t first = 0;
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    std::uint32_t* sizes = &bucket_[2 * kind];
    const std::uint32_t firm = sizes[0], all = firm + sizes[1];
    sizes[0] = first;
    sizes[1] = first + firm;
    first += (all + width - 1) / width * width;
  }
  core::refill(lanes_, first, kNone);
  chunks_.clear();
  for (std::uint32_t i = 0; i < contact_count_; ++i) lanes_[bucket_[key(i)]++] = i;
}

void GroupSolver::make_chunks() {
  const std::uint32_t width = kernels_->width;
  colour_chunks_.assign(1, 0);
  std::size_t memory = 0;
  std::uint32_t lane = 0;
  for (std::uint32_t colour = 0; colour < efforts_ * colouring_.colours; ++colour) {
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      // After sorting bucket_ holds the end of each bucket's contacts.
      const std::uint32_t end = bucket_[2 * (colour * kContactKinds + kind) + 1];
      std::uint32_t blocks = end > lane ? (end - lane + width - 1) / width : 0;
      while (blocks > 0) {
        const std::uint32_t count = std::min(blocks, block_grain_);
        chunks_.push_back({static_cast<ContactKind>(kind), count, memory, lane});
        memory += count * kernels_->kind[kind].block_bytes;
        lane += count * width;
        blocks -= count;
      }
    }
    colour_chunks_.push_back(static_cast<std::uint32_t>(chunks_.size()));
  }
  grow(memory_, (memory + sizeof(Memory) - 1) / sizeof(Memory));
}

void GroupSolver::add_phase(Op op) {
  std::uint32_t blocks = 1;
  if (op == Op::gather || op == Op::finish || op == Op::integrate_velocities ||
      op == Op::integrate_and_repeat || op == Op::integrate_positions ||
      op == Op::close_velocities || op == Op::rebalance || op == Op::fly) {
    blocks = (padded_rows_ + body_grain_ - 1) / body_grain_;
  } else if (op == Op::prepare_joints || op == Op::store_joints) {
    blocks = joints_.chunks();
  }
  if (blocks > 0) phases_.push_back({op, 0, blocks, substep_});
}

void GroupSolver::add_colours(Op op) {
  for (std::uint32_t effort = 0; effort < efforts_; ++effort) {
    const std::uint32_t passes = op == Op::solve || op == Op::relax ? 1u << effort : 1u;
    for (std::uint32_t pass = 0; pass < passes; ++pass) {
      for (std::uint32_t colour = 0; colour < colouring_.colours; ++colour) {
        const std::uint32_t* chunk = &colour_chunks_[effort * colouring_.colours + colour];
        if (chunk[1] == chunk[0]) continue;
        phases_.push_back({op, chunk[0], chunk[1] - chunk[0], substep_, pass + 1 == passes});
      }
    }
  }
}

void GroupSolver::add_joint_colours(Op op) {
  for (std::uint32_t colour = 0; colour < joints_.colours(); ++colour) {
    const std::uint32_t first = joints_.first_chunk(colour);
    phases_.push_back({op, first, joints_.first_chunk(colour + 1) - first, substep_});
  }
}

void GroupSolver::list_phases() {
  phases_.clear();
  substep_ = 0;
  add_phase(Op::gather);
  add_phase(Op::prepare_joints);
  const auto substeps = static_cast<std::uint32_t>(step_->settings->solver.substeps);
  for (; substep_ < substeps; ++substep_) {
    // The rows of contacts are the same in all substeps, so that impulses change the velocities
    // alike. Those of joints turn with the bodies.
    const bool repeats = substep_ > 0 && joints_.empty();
    add_phase(repeats ? Op::integrate_and_repeat : Op::integrate_velocities);
    add_joint_colours(Op::warm_start_joints);
    // A block is written by the worker that will work on it: both go by colours.
    if (!repeats) add_colours(substep_ == 0 ? Op::prepare_and_start : Op::warm_start);
    add_joint_colours(Op::solve_joints);
    add_colours(Op::solve);
    if (contact_count_ > 0) add_joint_colours(Op::answer_joints);
    add_phase(Op::integrate_positions);
    add_joint_colours(Op::relax_joints);
    add_colours(Op::relax);
  }
  if (!joints_.empty() && joints_.bodies.any_smooth()) {
    add_phase(Op::close_velocities);
    add_joint_colours(Op::close_joints);
  }
  if (has_bounces_.load(std::memory_order_relaxed) && joints_.empty()) {
    add_colours(Op::count_pushes);
    for (int i = 0; i < kStrikePasses; ++i) add_colours(Op::strike);
    add_colours(Op::take_back);
    add_phase(Op::rebalance);
    for (int i = 0; i < kReflectPasses; ++i) add_colours(Op::reflect);
  }
  if (has_bounces_.load(std::memory_order_relaxed)) add_colours(Op::restitute);
  add_colours(Op::store);
  if (has_bounces_.load(std::memory_order_relaxed) && joints_.empty()) {
    add_phase(Op::fly);
    for (int i = 0; i < kPartPasses; ++i) add_colours(Op::part);
    add_phase(Op::balance);
  }
  add_phase(Op::store_joints);
  add_phase(Op::finish);
}

void GroupSolver::run_serially() {
  for (std::uint32_t phase = 0; phase < phases_.size(); ++phase) {
    for (std::uint32_t block = 0; block < phases_[phase].blocks; ++block) {
      run_block(phase, block, 0);
    }
  }
}

void GroupSolver::run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t) {
  const Phase& p = phases_[phase];
  const std::uint32_t begin = block * body_grain_;
  const std::uint32_t end = std::min(padded_rows_, begin + body_grain_);
  switch (p.op) {
    case Op::gather:
      return gather_rows(begin, end);
    case Op::integrate_velocities:
      return integrate_velocities(begin, end, p.substep);
    case Op::integrate_and_repeat:
      return kernels_->integrate_and_repeat(pass_, begin, end);
    case Op::integrate_positions:
      return integrate_positions(begin, end);
    case Op::close_velocities:
      return joints_.bodies.kick(begin, end, joints_.h(), JointBatch::kHalfKick, true);
    case Op::rebalance:
      return rebalance_rows(std::max(begin, 1u), std::min(end, pass_.dynamic_end));
    case Op::fly:
      return fly_rows(begin, std::min(end, row_count_));
    case Op::balance:
      return balance_parted();
    case Op::finish:
      return finish_rows(begin, std::min(end, pass_.dynamic_end));
    case Op::prepare_joints:
    case Op::warm_start_joints:
    case Op::solve_joints:
    case Op::answer_joints:
    case Op::relax_joints:
    case Op::close_joints:
    case Op::store_joints:
      return run_joints(p, block);
    default:
      return run_contacts(p, chunks_[p.first + block]);
  }
}

// Passes that change nothing where no contact may bounce.
bool GroupSolver::is_bounce(Op op) {
  return op == Op::count_pushes || op == Op::strike || op == Op::take_back || op == Op::reflect ||
         op == Op::restitute || op == Op::part;
}

void GroupSolver::run_contacts(const Phase& phase, const Chunk& chunk) {
  if (is_bounce(phase.op) && !bounces_.load(std::memory_order_relaxed)) return;
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  std::byte* blocks = block_memory() + chunk.memory;
  switch (phase.op) {
    case Op::prepare_and_start:
      prepare_chunk(chunk);
      return kernel.warm_start(pass_, blocks, chunk.count);
    case Op::warm_start:
      return kernel.warm_start(pass_, blocks, chunk.count);
    case Op::solve:
      return kernel.solve(pass_, blocks, chunk.count);
    case Op::relax:
      return kernel.relax(relax_pass(phase), blocks, chunk.count);
    case Op::count_pushes:
      return kernel.count_pushes(pass_, blocks, chunk.count);
    case Op::strike:
      return kernel.strike(pass_, blocks, chunk.count);
    case Op::take_back:
      return take_back_chunk(chunk);
    case Op::reflect:
      return kernel.reflect(pass_, blocks, chunk.count);
    case Op::restitute:
      return kernel.restitute(pass_, blocks, chunk.count);
    case Op::part:
      return kernel.part(pass_, blocks, chunk.count);
    default:
      return store_chunk(chunk);
  }
}

const ContactPass& GroupSolver::relax_pass(const Phase& phase) const {
  if (!phase.books) return unbooked_pass_;
  const bool last =
      phase.substep + 1 == static_cast<std::uint32_t>(step_->settings->solver.substeps);
  return last ? last_pass_ : pass_;
}

void GroupSolver::run_joints(const Phase& phase, std::uint32_t block) {
  const auto op_of = [](Op op) {
    switch (op) {
      case Op::prepare_joints:
        return JointOp::prepare;
      case Op::warm_start_joints:
        return JointOp::warm_start;
      case Op::solve_joints:
        return JointOp::solve;
      case Op::answer_joints:
        return JointOp::answer;
      case Op::relax_joints:
        return JointOp::relax;
      case Op::close_joints:
        return JointOp::close;
      default:
        return JointOp::store;
    }
  };
  joints_.run(op_of(phase.op), phase.substep, phase.first + block);
}

void GroupSolver::integrate_velocities(std::uint32_t begin, std::uint32_t end,
                                       std::uint32_t substep) {
  if (joints_.empty()) return kernels_->integrate_velocities(pass_, begin, end);
  joints_.bodies.kick(begin, end, joints_.h(), JointBatch::kick(substep), false);
  kernels_->integrate_velocities(pass_, begin, end);
  joints_.bodies.publish_velocities(begin, std::min(end, pass_.dynamic_end));
}

void GroupSolver::integrate_positions(std::uint32_t begin, std::uint32_t end) {
  kernels_->integrate_positions(pass_, begin, end);
  if (!joints_.empty()) joints_.bodies.drift(begin, std::min(end, row_count_), joints_.h());
}

// ---- Bodies in.

void GroupSolver::gather_rows(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = begin; row < end; ++row) {
    delta_[row] = {{0, 0, 0}, 0, {0, 0, 0, 1}};
    if (row - 1 < body_count_) {
      const BodyIndex ahead = body_[std::min(row + kPrefetch, body_count_)];
      prefetch(step_->bodies->pose[ahead]);
      prefetch(step_->bodies->motion[ahead]);
      __builtin_prefetch(&step_->bodies->mass[ahead]);
      gather_body(row);
      continue;
    }
    start_[row] = {{0, 0, 0}, 0, {0, 0, 0}, 0};
    mass_[row] = {0, {0, 0, 0, 0, 0, 0}, 0};
    base_[row] = {{0, 0, 0}, 0, {0, 0, 0, 1}};
    spin_[row] = {{0, 0, 0}, 1, {0, 0, 0, 0, 0, 0}, 1, 0};
    if (row > body_count_ && row < row_count_) gather_kinematic(row);
    velocity_[row] = start_[row];
  }
}

void GroupSolver::gather_kinematic(std::uint32_t row) {
  const IslandScratch& islands = step_->solver->islands;
  const KinematicStart& start = islands.kinematics[islands.slot[body_[row]] & ~kKinematicSlot];
  start_[row] = {to_float(start.linear), 0, to_float(start.angular), 0};
  base_[row].orientation = to_float(start.orientation);
  if (!joints_.empty()) {
    joints_.bodies.gather_kinematic(row, {scalars(start.center), scalars(start.orientation)},
                                    scalars(start.linear), scalars(start.angular));
  }
}

float GroupSolver::damping_factor(double damping) const {
  if (damping == 0) return 1;
  const double h = step_->dt / step_->settings->solver.substeps;
  return core::rounded_to_float(1 / (1 + h * damping));
}

void GroupSolver::gather_body(std::uint32_t row) {
  const BodyIndex index = body_[row];
  const Bodies& bodies = *step_->bodies;
  const std::uint32_t flags = bodies.flags[index];
  const BodyPose& pose = bodies.pose[index];
  const BodyMotion& motion = bodies.motion[index];
  const BodyMass& mass = bodies.mass[index];
  const ExternalForce force =
      external_force(*step_, index, step_->time, pose.center, motion.linear, motion.angular);
  start_[row] = {to_float(motion.linear), 0, to_float(motion.angular), 0};
  velocity_[row] = start_[row];
  const Vec3 acceleration = force.force * mass.inv_mass;
  base_[row] = {to_float(acceleration), kPatchLever * mass.inner_radius,
                to_float(pose.orientation)};

  const bool isotropic = (flags & kIsotropic) != 0;
  const bool round = isotropic && !(flags & kLockMask);
  MassRow& m = mass_[row];
  m.inv_mass = core::rounded_to_float(mass.inv_mass);
  m.lock_flags = flags & kLockMask;
  SpinRow& spin = spin_[row];
  Vec3 angular_acceleration;
  if (round) {
    const auto inverse = core::rounded_to_float(mass.inv_inertia_b(0, 0));
    m.inv_inertia = {inverse, 0, 0, inverse, 0, inverse};
    std::fill_n(spin.inertia, 6, 0.0f);
    angular_acceleration = force.torque * mass.inv_inertia_b(0, 0);
  } else {
    const Mat3 inverse = inv_inertia_w(mass, pose.orientation, flags);
    m.inv_inertia = rounded(inverse);
    const Mat3 inertia = inertia_w(mass, pose.orientation);
    const double six[6] = {inertia(0, 0), inertia(0, 1), inertia(0, 2),
                           inertia(1, 1), inertia(1, 2), inertia(2, 2)};
    for (int k = 0; k < 6; ++k) spin.inertia[k] = core::rounded_to_float(six[k]);
    angular_acceleration = inverse * force.torque;
  }
  spin.angular_acceleration = to_float(angular_acceleration);
  spin.linear_factor = damping_factor(mass.linear_damping);
  spin.angular_factor = damping_factor(mass.angular_damping);
  // What turns so far in a step turns exactly, after its impacts (FastWatch).
  const bool turns_later = (flags & kContinuous) && motion.angular.norm() * step_->dt > kLargeTurn;
  spin.gyroscopic = isotropic || turns_later || (flags & kLockMask) ? 0.0f : 1.0f;

  ledger_[row] = {};
  Outlook& outlook = outlook_[row];
  outlook.linear = motion.linear + acceleration * step_->dt;
  outlook.angular_momentum = motion.angular_momentum + force.torque * step_->dt;
  outlook.smooth_change = core::rounded_to_float(2 * step_->dt * acceleration.norm());
  outlook.from_rows = mass.linear_damping > 0 || mass.angular_damping > 0;
  if (!joints_.empty() && joints_.bodies.owns(row)) {
    joints_.bodies.gather(*step_, row, index, force);
    const Sym3d& inverse = joints_.bodies.at(row).inv_inertia;
    m.inv_inertia = {core::rounded_to_float(inverse.xx), core::rounded_to_float(inverse.xy),
                     core::rounded_to_float(inverse.xz), core::rounded_to_float(inverse.yy),
                     core::rounded_to_float(inverse.yz), core::rounded_to_float(inverse.zz)};
  }
}

// ---- Contacts in and out.

void GroupSolver::prepare_chunk(const Chunk& chunk) {
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  const bool full =
      chunk.kind == ContactKind::points4_full || chunk.kind == ContactKind::point1_full;
  const bool foreseen = full && has_bounces_.load(std::memory_order_relaxed);
  std::byte* block = block_memory() + chunk.memory;
  LaneInput input;
  std::uint32_t lane = chunk.first_lane;
  for (std::uint32_t i = 0; i < chunk.count; ++i, block += kernel.block_bytes) {
    for (std::uint32_t k = 0; k < kernels_->width; ++k) {
      const std::uint32_t contact = lanes_[lane++];
      if (foreseen && contact != kNone && touch_time(contact) > 0) {
        const Vec3 moved = offset_after(contact, 0, double(touch_time(contact)));
        for (int axis = 0; axis < 3; ++axis) contacts_[contact].offset[axis] = moved[axis];
      }
      fill_lane(input, k, contact);
      if (full) fill_full(input, k, contact, false);
    }
    if (kernel.prepare(pass_, input, block)) bounces_.store(true, std::memory_order_relaxed);
  }
}

void GroupSolver::take_back_chunk(const Chunk& chunk) {
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  std::byte* block = block_memory() + chunk.memory;
  LaneInput input;
  std::uint32_t lane = chunk.first_lane;
  for (std::uint32_t i = 0; i < chunk.count; ++i, block += kernel.block_bytes) {
    for (std::uint32_t k = 0; k < kernels_->width; ++k) {
      const std::uint32_t contact = lanes_[lane++];
      fill_lane(input, k, contact);
      fill_full(input, k, contact, true);
    }
    kernel.take_back(pass_, input, block);
  }
}

// Struck bodies fly freely to the impacts of their island.
void GroupSolver::rebalance_rows(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = begin; row < end; ++row) {
    VelocityRow& velocity = velocity_[row];
    if (!(velocity.struck > 0) || !flies(row)) continue;
    const BodyIndex body = body_[row];
    const BodyMotion& motion = step_->bodies->motion[body];
    const auto time = double(impact_time_[row]);
    velocity.linear =
        to_float(Vec3(motion.linear + (outlook_[row].linear - motion.linear) * (time / step_->dt)));
    velocity.angular = spin_after(row, time).angular;
  }
}

// Whether a body that no contact touches flies as external forces alone make it.
bool GroupSolver::flies(std::uint32_t row) const {
  if (row - 1 >= body_count_) return true;
  return joints_.empty() && held_[row] == 0 && !outlook_[row].from_rows &&
         mass_[row].lock_flags == 0;
}

// m: how far a body flies in `time` s from the start of the step, if no contact touches it.
Vec3 GroupSolver::way(std::uint32_t row, double time) const {
  if (row == 0) return Vec3::Zero();
  if (row - 1 >= body_count_) {
    const IslandScratch& islands = step_->solver->islands;
    return time * islands.kinematics[islands.slot[body_[row]] & ~kKinematicSlot].linear;
  }
  const Vec3& linear = step_->bodies->motion[body_[row]].linear;
  return time * linear + (0.5 * time * time / step_->dt) * (outlook_[row].linear - linear);
}

// m: centre of b from centre of a at a time, by `offset`, which is of another.
Vec3 GroupSolver::offset_after(std::uint32_t contact, double from, double time) const {
  const double* offset = contacts_[contact].offset;
  const std::uint32_t a = row_a_[contact], b = row_b_[contact];
  return Vec3(offset[0], offset[1], offset[2]) +
         ((way(b, time) - way(b, from)) - (way(a, time) - way(a, from)));
}

float GroupSolver::touch_time(std::uint32_t contact) const {
  return step_->contacts->manifolds[contacts_[contact].manifold].touch_time;
}

// Whether a contact has no gap at the start of the step.
bool GroupSolver::touches(std::uint32_t contact) const {
  return gap_of(step_->contacts->manifolds[contacts_[contact].manifold]) <= kTouch;
}

// s: see set_impact_times.
double GroupSolver::time_of_impacts(std::uint32_t contact) const {
  const std::uint32_t a = row_a_[contact];
  return double(impact_time_[a - 1 < body_count_ ? a : row_b_[contact]]);
}

// N m, external.
Vec3 GroupSolver::torque_on(std::uint32_t row) const {
  return (outlook_[row].angular_momentum - step_->bodies->motion[body_[row]].angular_momentum) /
         step_->dt;
}

void GroupSolver::fill_lane(LaneInput& input, std::uint32_t lane, std::uint32_t index) const {
  const bool padding = index == kNone;
  const Manifold& manifold =
      padding ? empty_manifold() : step_->contacts->manifolds[contacts_[index].manifold];
  prefetch(manifold);
  input.manifold[lane] = reinterpret_cast<const float*>(&manifold);
  input.row_a[lane] = padding ? 0 : row_a_[index];
  input.row_b[lane] = padding ? 0 : row_b_[index];
  for (int k = 0; k < 3; ++k) {
    input.offset[k][lane] = padding ? 0.0f : core::rounded_to_float(contacts_[index].offset[k]);
  }
}

// `impact`: for an impact among several bodies, at the time of those; else as the manifold is.
void GroupSolver::fill_full(LaneInput& input, std::uint32_t lane, std::uint32_t contact,
                            bool impact) const {
  const bool padding = contact == kNone;
  const std::uint32_t a = padding ? 0 : row_a_[contact], b = padding ? 0 : row_b_[contact];
  const bool free = !padding && flies(a) && flies(b);
  double time = padding ? 0 : double(touch_time(contact));
  input.touch[lane] = free && (time > 0 || touches(contact)) ? core::rounded_to_float(time) : -1;
  input.held[lane] = free ? 0.0f : 1.0f;
  Vec3 shift = Vec3::Zero();
  if (impact && free) {
    const double then = time_of_impacts(contact);
    shift = way(b, then) - way(a, then) - (way(b, time) - way(a, time));
    time = then;
  }
  for (int k = 0; k < 3; ++k) input.shift[k][lane] = core::rounded_to_float(shift[k]);
  fill_side(input, false, lane, a, free ? time : 0);
  fill_side(input, true, lane, b, free ? time : 0);
}

void GroupSolver::fill_side(LaneInput& input, bool is_b, std::uint32_t lane, std::uint32_t row,
                            double time) const {
  auto& inv_mass = is_b ? input.inv_mass_b : input.inv_mass_a;
  auto& inertia = is_b ? input.inertia_b : input.inertia_a;
  auto& angular = is_b ? input.angular_b : input.angular_a;
  const MassRow& mass = mass_[row];
  Sym3f inverse = mass.inv_inertia;
  V3f omega = start_[row].angular;
  if (time > 0 && row - 1 < body_count_) {
    const Spin spin = spin_after(row, time);
    inverse = spin.inv_inertia;
    omega = spin.angular;
  }
  for (std::uint32_t k = 0; k < 3; ++k)
    inv_mass[k][lane] = mass.lock_flags & (kLockX << k) ? 0.0f : mass.inv_mass;
  const float six[6] = {inverse.xx, inverse.xy, inverse.xz, inverse.yy, inverse.yz, inverse.zz};
  for (int k = 0; k < 6; ++k) inertia[k][lane] = six[k];
  const float three[3] = {omega.x, omega.y, omega.z};
  for (int k = 0; k < 3; ++k) angular[k][lane] = three[k];
}

// How a body turns `time` s after the start of the step, if no contact touches it.
GroupSolver::Spin GroupSolver::spin_after(std::uint32_t row, double time) const {
  const BodyIndex body = body_[row];
  const BodyMass& mass = step_->bodies->mass[body];
  const std::uint32_t flags = step_->bodies->flags[body];
  const Vec3& start = step_->bodies->motion[body].angular_momentum;
  const Vec3 torque = torque_on(row), momentum = start + time * torque;
  if (flags & kIsotropic)
    return {mass_[row].inv_inertia, to_float(Vec3(momentum * mass.inv_inertia_b(0, 0)))};
  const Mat3 inverse = inv_inertia_w(
      mass,
      orientation_after(time, mass, flags, step_->bodies->pose[body].orientation, start, torque),
      flags);
  return {rounded(inverse), to_float(Vec3(inverse * momentum))};
}

void GroupSolver::store_chunk(const Chunk& chunk) {
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  const std::byte* block = block_memory() + chunk.memory;
  Manifold sink;  // of padding lanes
  LaneOutput output;
  const std::uint32_t* contact = &lanes_[chunk.first_lane];
  for (std::uint32_t i = 0; i < chunk.count; ++i, block += kernel.block_bytes) {
    for (std::uint32_t k = 0; k < kernels_->width; ++k) {
      Manifold& manifold =
          contact[k] == kNone ? sink : step_->contacts->manifolds[contacts_[contact[k]].manifold];
      prefetch(manifold);
      output.manifold[k] = reinterpret_cast<float*>(&manifold);
    }
    kernel.store(block, output);
    for (std::uint32_t k = 0; k < kernels_->width; ++k) {
      if (contact[k] == kNone) continue;
      book(output, k, contact[k]);
      if (step_->effects) judge(contact[k]);
    }
    contact += kernels_->width;
  }
}

// `load`: N s of a mean point in a substep.
void GroupSolver::carry(Manifold& manifold, float load) const {
  manifold.begins = false;
  manifold.pressed_time = load > 0 ? manifold.pressed_time + pass_.substep * pass_.substeps : 0;
  const float borne =
      stands(load, manifold.statics_impulse) ? manifold.statics_impulse : kNear * load;
  manifold.standing_impulse += carry_part_ * (borne - manifold.standing_impulse);
  manifold.carried_impulse += carry_part_ * (carried_of(manifold, load) - manifold.carried_impulse);
}

// Before it is booked.
void GroupSolver::note_push(std::uint32_t index, bool bounced) {
  for (const std::uint32_t row : {row_a_[index], row_b_[index]}) {
    if (row - 1 >= body_count_) continue;
    Ledger& ledger = ledger_[row];
    ledger.several = ledger.several || ledger.pushed;
    if (!bounced) continue;
    ledger.bounced = true;
    ledger.bounce_time = touch_time(index);
  }
}

// Equal and opposite in double, at one and the same point: momentum and angular momentum of the two
// bodies together stay put to rounding in double.
void GroupSolver::book(const LaneOutput& output, std::uint32_t lane, std::uint32_t index) {
  const LaneOutput::Row& push_row = output.push[lane];
  const LaneOutput::Row& torque_row = output.torque[lane];
  const Vec3 push = to_double(push_row.v), torque_a = to_double(torque_row.v);
  // NaN as well: the body is to be set aside, not to fly on. A bounce may take back all of the push
  // but not its friction.
  const bool pushed = !(push_row.s <= 0) || !push.isZero(0) || !torque_a.isZero(0);
  const bool impact = pushed && torque_row.s > kImpactSpeed;
  Manifold& manifold = step_->contacts->manifolds[contacts_[index].manifold];
  const float* n = manifold.normal_impulse;
  carry(manifold, ((n[0] + n[1]) + (n[2] + n[3])) / static_cast<float>(manifold.point_count));
  const auto add = [&](std::uint32_t row, const Vec3& impulse, const Vec3& torque, double sign) {
    if (row - 1 >= body_count_) return;
    Ledger& ledger = ledger_[row];
    for (int k = 0; k < 3; ++k) {
      ledger.impulse[k] += sign * impulse[k];
      ledger.angular_impulse[k] += sign * torque[k];
    }
    ledger.pushed = ledger.pushed || pushed;
    if (pushed) ledger.held.hold(manifold.normal, manifold.point_count > 1);
    ledger.impact = ledger.impact || impact;
  };
  const double* o = contacts_[index].offset;
  Vec3 offset(o[0], o[1], o[2]);
  const bool bounces = bounces_.load(std::memory_order_relaxed);
  if (bounces && pushed) note_push(index, output.bounced[lane] > 0);
  if (bounces && joints_.empty() && output.struck[lane] > 0 && flies(row_a_[index]) &&
      flies(row_b_[index]))
    offset = offset_after(index, double(touch_time(index)), time_of_impacts(index));
  add(row_a_[index], push, torque_a, -1);
  add(row_b_[index], push, torque_a - offset.cross(push), 1);
}

// How well the contact keeps its law, by the rows as the last pass left them.
void GroupSolver::judge(std::uint32_t index) {
  const Contact& contact = contacts_[index];
  const Manifold& manifold = step_->contacts->manifolds[contact.manifold];
  const Vec3 offset(contact.offset[0], contact.offset[1], contact.offset[2]);
  const Vec3 n = to_double(manifold.normal);
  ContactSide side[2];
  Vec3 shift[2];
  Mat3 turn[2];
  for (int k = 0; k < 2; ++k) {
    const std::uint32_t row = k == 0 ? row_a_[index] : row_b_[index];
    const MassRow& mass = mass_[row];
    const Sym3f& inverse = mass.inv_inertia;
    side[k].linear = to_double(velocity_[row].linear);
    side[k].angular = to_double(velocity_[row].angular);
    side[k].inv_mass = unlocked(Vec3::Constant(double(mass.inv_mass)), mass.lock_flags, kLockX);
    side[k].inv_inertia << double(inverse.xx), double(inverse.xy), double(inverse.xz),
        double(inverse.xy), double(inverse.yy), double(inverse.yz), double(inverse.xz),
        double(inverse.yz), double(inverse.zz);
    const Q4f& q = delta_[row].rotation;
    shift[k] = to_double(delta_[row].translation);
    turn[k] = Quat(double(q.w), double(q.x), double(q.y), double(q.z)).toRotationMatrix();
  }
  double gap[4] = {};
  for (std::uint32_t i = 0; i < manifold.point_count; ++i) {
    // A rounded surface turns about the centre of its rounding.
    const Vec3 at = to_double(manifold.points[i].position);
    const Vec3 arm_a = at - double(manifold.rounding_a) * n;
    const Vec3 arm_b = at - offset + double(manifold.rounding_b) * n;
    const Vec3 moved = shift[1] + turn[1] * arm_b - arm_b - shift[0] - turn[0] * arm_a + arm_a;
    gap[i] = double(manifold.points[i].separation) + n.dot(moved);
  }
  step_->effects->contacts[contact.manifold] =
      contact_residual(*step_, manifold, offset, side[0], side[1], gap, double(pass_.substep));
}

// ---- Bodies out.

void GroupSolver::finish_rows(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = std::max(begin, 1u); row < end; ++row) {
    FastWatch watch(*step_, body_[row]);
    EffectWatch effect(*step_, body_[row]);
    const Ledger& ledger = ledger_[row];
    const Outlook& outlook = outlook_[row];
    const Vec3 push(ledger.impulse[0], ledger.impulse[1], ledger.impulse[2]);
    const Vec3 spin(ledger.angular_impulse[0], ledger.angular_impulse[1],
                    ledger.angular_impulse[2]);
    const bool from_rows = outlook.from_rows;
    if (!joints_.empty() && joints_.bodies.owns(row)) {
      finish_jointed(row);
      effect.finish(push, spin);
      watch.finish(FastFlight::joined);
    } else if (!ledger.pushed && !from_rows) {
      fly_free(*step_, body_[row]);  // near others, but nothing touched it
      watch.finish(FastFlight::free);
    } else {
      finish_body(row);
      if (from_rows) {
        effect.finish(push, spin);
      } else if (effect.on()) {
        const double mass = step_->bodies->mass[body_[row]].mass;
        const BodyMotion& before = effect.before();
        effect.finish_balanced(push, spin, mass * (outlook.linear - before.linear),
                               outlook.angular_momentum - before.angular_momentum);
      }
      watch.finish(from_rows ? FastFlight::joined : FastFlight::pushed, time_of_impact(row));
    }
  }
}

// s: when all that contacts gave to the body in this step was given; negative: over the step.
double GroupSolver::time_of_impact(std::uint32_t row) const {
  if (!bounces_.load(std::memory_order_relaxed) || !flies(row)) return -1;
  const Ledger& ledger = ledger_[row];
  if (velocity_[row].struck > 0) return double(impact_time_[row]);
  return ledger.bounced && !ledger.several ? double(ledger.bounce_time) : -1;
}

void GroupSolver::fly_rows(std::uint32_t begin, std::uint32_t end) {
  if (!bounces_.load(std::memory_order_relaxed)) return;
  for (std::uint32_t row = begin; row < end; ++row) {
    flown_[row] = delta_[row];
    flown_from_[row] = delta_[row].translation;
    const double time = row - 1 < body_count_ ? time_of_impact(row) : -1;
    if (time < 0) continue;
    const BodyPose& pose = step_->bodies->pose[body_[row]];
    const BodyPose next = pose_after_impact(row, time);
    flown_[row].translation = flown_from_[row] = to_float(Vec3(next.center - pose.center));
    flown_[row].rotation = to_float(Quat(next.orientation * pose.orientation.conjugate()));
  }
}

// Where the substeps have brought a body that has these velocities after the step, m/s and rad/s.
void GroupSolver::go_by_substeps(std::uint32_t row, const Vec3& linear, const Vec3& spin,
                                 BodyPose& next) const {
  const BodyIndex index = body_[row];
  const BodyPose& pose = step_->bodies->pose[index];
  const BodyMotion& motion = step_->bodies->motion[index];
  const double radius = step_->bodies->mass[index].radius;
  const Ledger& ledger = ledger_[row];
  const DeltaRow& delta = delta_[row];
  next.center = pose.center + to_double(delta.translation);
  Quat turn(double(delta.rotation.w), double(delta.rotation.x), double(delta.rotation.y),
            double(delta.rotation.z));
  // Substeps moved the body by the velocity after each: half a substep's change too far. Taken
  // back where the change is the work of forces; an impact's place is exact as it is.
  const Vec3 change = ledger.held.free_part(linear - motion.linear);
  const Vec3 turn_change = ledger.held.free_turn(spin - motion.angular);
  const double limit = static_cast<double>(outlook_[row].smooth_change), square = limit * limit;
  if (!ledger.impact && change.squaredNorm() <= square &&
      turn_change.squaredNorm() * (radius * radius) <= square) {
    const double half = 0.5 * step_->dt / step_->settings->solver.substeps;
    next.center -= half * change;
    const Vec3 back = -0.5 * half * turn_change;
    turn = Quat(1, back.x(), back.y(), back.z()) * turn;
  }
  next.orientation = made_unit(turn * pose.orientation);
}

// Where a body comes that flies freely to its impact, and on from it.
BodyPose GroupSolver::pose_after_impact(std::uint32_t row, double time) const {
  const BodyIndex index = body_[row];
  const BodyPose& pose = step_->bodies->pose[index];
  const BodyMass& mass = step_->bodies->mass[index];
  const std::uint32_t flags = step_->bodies->flags[index];
  const Vec3& momentum = step_->bodies->motion[index].angular_momentum;
  const Ledger& ledger = ledger_[row];
  const double rest = step_->dt - time;
  const Vec3 impulse(ledger.impulse[0], ledger.impulse[1], ledger.impulse[2]);
  const Vec3 spin(ledger.angular_impulse[0], ledger.angular_impulse[1], ledger.angular_impulse[2]);
  const Vec3 torque = torque_on(row);
  const Quat there = orientation_after(time, mass, flags, pose.orientation, momentum, torque);
  return {pose.center + way(row, step_->dt) + (rest * mass.inv_mass) * impulse,
          orientation_after(rest, mass, flags, there, momentum + time * torque + spin, torque)};
}

// m: how far the body has been moved away from others that it would have flown into.
Vec3 GroupSolver::parted(std::uint32_t row) const {
  return to_double(flown_[row].translation) - to_double(flown_from_[row]);
}

// Where nothing but contacts acts, bodies that were moved apart keep the moment of their momenta: all of the
// island are moved by little, d = r x (v - mean v) with the r that takes the change back, which moves the
// common centre of mass no more than parting did.
void GroupSolver::balance_parted() {
  if (!bounces_.load(std::memory_order_relaxed)) return;
  std::uint32_t row = 1;
  for (std::uint32_t i = 0; i < group_.count; ++i) {
    const std::uint32_t end = row + step_->islands->islands[group_.first + i].body_count;
    balance_parted(row, end);
    row = end;
  }
}

void GroupSolver::balance_parted(std::uint32_t begin, std::uint32_t end) {
  Vec3 momentum = Vec3::Zero();
  double total = 0;
  for (std::uint32_t row = begin; row < end; ++row) {
    if (is_forced(row)) return;
    const double mass = step_->bodies->mass[body_[row]].mass;
    momentum += mass * to_double(velocity_[row].linear);
    total += mass;
  }
  const Vec3 mean = momentum / total;
  Vec3 change = Vec3::Zero();
  Mat3 spread = Mat3::Zero();
  for (std::uint32_t row = begin; row < end; ++row) {
    const double mass = step_->bodies->mass[body_[row]].mass;
    const Vec3 v = to_double(velocity_[row].linear) - mean;
    change += mass * parted(row).cross(v);
    spread += mass * (v.squaredNorm() * Mat3::Identity() - v * v.transpose());
  }
  if (change.isZero(0)) return;
  spread += (1e-9 * spread.trace()) * Mat3::Identity();  // all along one line: none about that
  const Vec3 r = spread.inverse() * change;
  for (std::uint32_t row = begin; row < end; ++row) {
    const Vec3 by = r.cross(to_double(velocity_[row].linear) - mean);
    flown_[row].translation = flown_[row].translation + to_float(by);
  }
}

void GroupSolver::finish_body(std::uint32_t row) {
  const BodyIndex index = body_[row];
  Bodies& bodies = *step_->bodies;
  const std::uint32_t flags = bodies.flags[index];
  const BodyMass& mass = bodies.mass[index];
  const Ledger& ledger = ledger_[row];
  const Outlook& outlook = outlook_[row];
  const Vec3 spin = to_double(velocity_[row].angular);
  BodyMotion after;
  if (outlook.from_rows) {
    after.linear = to_double(velocity_[row].linear);
  } else {
    after.linear =
        outlook.linear +
        unlocked(Vec3(ledger.impulse[0], ledger.impulse[1], ledger.impulse[2]), flags, kLockX) *
            mass.inv_mass;
    after.angular_momentum =
        outlook.angular_momentum +
        Vec3(ledger.angular_impulse[0], ledger.angular_impulse[1], ledger.angular_impulse[2]);
  }

  const double impact = time_of_impact(row);
  BodyPose next;
  if (impact < 0)
    go_by_substeps(row, after.linear, spin, next);
  else
    next = pose_after_impact(row, impact);
  if (bounces_.load(std::memory_order_relaxed) && joints_.empty()) next.center += parted(row);
  after.angular = outlook.from_rows
                      ? spin
                      : angular_velocity(mass, flags, next.orientation, after.angular_momentum);
  if (outlook.from_rows) {
    after.angular_momentum = flags & kIsotropic
                                 ? Vec3(after.angular * mass.inertia_b(0, 0))
                                 : Vec3(inertia_w(mass, next.orientation) * after.angular);
  } else if (flags & (kLockRx | kLockRy | kLockRz)) {
    after.angular_momentum = inertia_w(mass, next.orientation) * after.angular;
  }

  accept(bodies, index, next, after);
}

void GroupSolver::finish_jointed(std::uint32_t row) {
  BodyPose next;
  BodyMotion after;
  joints_.bodies.result(*step_->bodies, row, body_[row], next, after);
  accept(*step_->bodies, body_[row], next, after);
}

}  // namespace skerry::solver
