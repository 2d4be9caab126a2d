// Contacts as the kernels see them: blocks of W manifolds side by side, one float per lane and slot,
// in the contact space of docs/solver.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/contacts.h"
#include "core/vec.h"
#include "solver/solver_body.h"

namespace skerry::solver {

inline constexpr std::uint32_t kMaxWidth = 16;  // lanes of the widest kernels

// Which kernel solves a manifold. A property of the manifold and its two bodies alone, so that
// neither width nor neighbours can change it.
enum class ContactKind : std::uint8_t {
  points4,       // up to four points
  point1,        // one point: no twist
  points4_full,  // with axis locks, rolling resistance or restitution
  point1_full,
};
inline constexpr std::uint32_t kContactKinds = 4;

// Soft constraint of a substep (Catto, "Soft Constraints", GDC 2011).
struct Softness {
  float bias_rate;      // 1/s, of the error to remove
  float mass_scale;     // of the effective mass
  float impulse_scale;  // of the accumulated impulse that leaks away
};

// What a body needs beside SolverBodies to integrate its velocity over a substep.
struct alignas(64) SpinRow {
  core::V3f angular_acceleration;  // rad/s^2, of external torques
  float linear_factor;             // of damping over a substep; 1: none
  float inertia[6];                // kg m^2, world, at the start of the step: xx xy xz yy yz zz
  float angular_factor;
  float gyroscopic;  // 1: integrate omega x (I omega); 0: isotropic or locked
};

// Constants and body rows of all passes over one group.
struct ContactPass {
  VelocityRow* velocity = nullptr;
  VelocityRow* start = nullptr;   // velocities at the start of the step
  VelocityRow* forced = nullptr;  // of this substep, after external forces and before impulses
  DeltaRow* delta = nullptr;
  DeltaRow* flown = nullptr;  // where bodies come that fly to their impacts and on
  const MassRow* mass = nullptr;
  const BaseRow* base = nullptr;
  const SpinRow* spin = nullptr;
  std::uint32_t dynamic_end = 1;  // rows [1, dynamic_end) are written, no others

  float substep = 0;      // s
  float inv_substep = 0;  // 1/s
  float substeps = 1;
  float max_push = 0;               // m/s
  float restitution_threshold = 0;  // m/s
  Softness soft = {};
  float soft_load = 0;  // m/s: most impulse per effective mass beyond `carried` that softens
  float deflection =
      0;              // s: depth of a soft contact that bears 1 m/s per effective mass in a substep
  bool books = true;  // the relax pass adds its impulses to the sums over the step
  bool last = false;  // it is the step's last: single points rub about their normals then
};

// A core::Manifold as the kernels load and store it: rows of four floats.
enum ManifoldRow : std::uint32_t {
  kNormalRow = 0,    // normal, count of points
  kPointRow = 4,     // of the first of four points: position, separation
  kImpulseRow = 20,  // of the points
  kFrictionRow = 24,
  kRollingRow = 28,   // rolling impulse, total impulse
  kMaterialRow = 32,  // friction, restitution, rolling resistance, approach speed
  kRoundingRow = 40,  // carried impulse, rounding of a, of b
};
static_assert(offsetof(core::Manifold, points) == 4 * kPointRow &&
              sizeof(core::ManifoldPoint) == 4 * 4 &&
              offsetof(core::Manifold, normal_impulse) == 4 * kImpulseRow &&
              offsetof(core::Manifold, friction_impulse) == 4 * kFrictionRow &&
              offsetof(core::Manifold, rolling_impulse) == 4 * kRollingRow &&
              offsetof(core::Manifold, friction) == 4 * kMaterialRow &&
              offsetof(core::Manifold, carried_impulse) == 4 * kRoundingRow &&
              offsetof(core::Manifold, rounding_a) == 4 * kRoundingRow + 4 &&
              sizeof(core::Manifold) >= 4 * kRoundingRow + 16);

// One block's manifolds on their way into the lanes. Padding lanes: an empty manifold, rows 0.
struct alignas(64) LaneInput {
  const float* manifold[kMaxWidth];
  std::uint32_t row_a[kMaxWidth], row_b[kMaxWidth];
  float offset[3][kMaxWidth];  // m, centre of b from centre of a
  // For the full kinds alone. Inverse mass per axis; inverse inertia (as in ContactBlock) and angular
  // velocity at the time of the manifold's geometry; that time, if the two are to bounce off each
  // other then, alone (docs/decisions/0025), else negative, s.
  float inv_mass_a[3][kMaxWidth], inv_mass_b[3][kMaxWidth];
  float inertia_a[6][kMaxWidth], inertia_b[6][kMaxWidth];
  float angular_a[3][kMaxWidth], angular_b[3][kMaxWidth];
  float touch[kMaxWidth];
  float gap[4][kMaxWidth];   // m, separations of the points at that time
  float slowest[kMaxWidth];  // m/s: slower approaches do not bounce
  // Of take_back alone: m, how much farther b is from a when impacts among several happen; above 0 if one
  // of them does not fly freely until then.
  float shift[3][kMaxWidth];
  float held[kMaxWidth];
};

// And out of them: impulses for the next step and for events into the manifolds, and what the step
// gave to the bodies, restitution included.
struct alignas(64) LaneOutput {
  float* manifold[kMaxWidth];
  struct alignas(16) Row {
    core::V3f v;
    float s;
  };
  Row push[kMaxWidth];    // N s, world, on b; sum along the normal
  Row torque[kMaxWidth];  // N m s, world, on b about the centre of a; approach speed, m/s
  // Above 0: the contact bounced at LaneInput::touch; it took part in an impact among several.
  float bounced[kMaxWidth], struck[kMaxWidth];
};

template <int W>
struct alignas(4 * W) Lanes {
  float v[W];
};

// Slots that depend on the number of points.
template <int W, int P>
struct PointLanes {
  Lanes<W> u[P], v[P];   // m, along the tangents, from the contact centre
  Lanes<W> coupling[6];  // inverse mass between points 01 02 03 12 13 23
  Lanes<W> mass[P];      // effective mass along the normal; 0 beyond the manifold's points
  // Impulses that stop all four points at once follow from sums over the points by this symmetric
  // matrix, of (1, v, -u): 00 01 02 11 12 22. 00 is 0 without points and negative if there is none.
  Lanes<W> together[6];
  Lanes<W> separation[P];  // m at the start of the step
  Lanes<W> impulse[P];     // N s, of the present substep
};
template <int W>
struct PointLanes<W, 1> {
  Lanes<W> mass[1], separation[1], impulse[1];
};

// Velocity change by the impulses solved before it in the relax pass, per unit impulse.
template <int W, int P>
struct FrictionLanes {
  Lanes<W> from_normal[2][3];  // tangent velocities from F, T1, T2
  Lanes<W> inverse[3];         // inverse of their 2x2 inverse mass: 11 12 22
  Lanes<W> slide_mass;         // 1 / its largest eigenvalue
  Lanes<W> twist_from[5];      // from F, T1, T2, friction 1, friction 2
  Lanes<W> twist_mass;
  Lanes<W> lever[P];    // m, of the points
  Lanes<W> impulse[3];  // friction 1, friction 2, twist
  Lanes<W> coefficient;
  Lanes<W> normal_sum[P];  // over the substeps
  Lanes<W> sum[3];         // likewise: friction 1, friction 2, twist
};
template <int W>
struct FrictionLanes<W, 1> {
  Lanes<W> from_normal[2][1];
  Lanes<W> inverse[3];
  Lanes<W> slide_mass;
  Lanes<W> impulse[2];
  Lanes<W> coefficient;
  Lanes<W> normal_sum[1];
  Lanes<W> sum[2];
  Lanes<W> twist_reach;  // m: coefficient times lever; most twist per push
  Lanes<W> twist;        // N m s about the normal, of the whole step
};

template <int W, int P, bool kFull>
struct FullLanes {
  Lanes<W> inv_mass_a, inv_mass_b;
};
template <int W, int P>
struct FullLanes<W, P, true> {
  Lanes<W> inv_mass_a[3], inv_mass_b[3];
  Lanes<W> bounce[P];       // m^2/s^2, square of the wanted speed of departure at touch; 0: none
  Lanes<W> max_impulse[P];  // N s, over the substeps
  Lanes<W> acceleration;    // m/s^2, relative, external, along the normal
  Lanes<W> rolling_inverse[3], rolling_slide_mass;
  Lanes<W> rolling_impulse[2], rolling_coefficient, rolling_sum[2];
  Lanes<W> touch, gap[P], slowest, angular_a[3], angular_b[3];  // see LaneInput
  Lanes<W> restitution;
  Lanes<W> bounced;  // 1: at that time
};

template <int W, int P, bool kFull>
struct alignas(64) ContactBlock {
  std::uint32_t row_a[W], row_b[W];
  Lanes<W> normal[3], arm_a[3], arm_b[3];  // arms: contact centre from the centres of mass
  Lanes<W> inertia_a[6], inertia_b[6];     // inverse, world: xx xy xz yy yz zz
  Lanes<W> tangent[3];                     // the first; the second is normal x tangent
  FullLanes<W, P, kFull> full;
  PointLanes<W, P> points;
  FrictionLanes<W, P> friction;
  Lanes<W> carried;                 // N s, of every point
  Lanes<W> rounding_a, rounding_b;  // m, see core::Manifold
  Lanes<W> approach;                // m/s
};

// The kernels read rows as floats.
static_assert(sizeof(VelocityRow) == 32 && sizeof(DeltaRow) == 32 && sizeof(MassRow) == 32 &&
              sizeof(BaseRow) == 32 && sizeof(SpinRow) == 64);

// One width's kernels; the same bits from every one of them.
struct ContactKernels {
  struct OfKind {
    std::size_t block_bytes;
    // Whether a point may bounce.
    bool (*prepare)(const ContactPass& pass, const LaneInput& input, void* block);
    // Over `count` consecutive blocks of one colour.
    void (*warm_start)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*solve)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*relax)(const ContactPass& pass, void* blocks, std::uint32_t count);
    // Impacts among several bodies; take_back over one block, with the input of prepare.
    void (*count_pushes)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*strike)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*take_back)(const ContactPass& pass, const LaneInput& input, void* block);
    void (*reflect)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*restitute)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*part)(const ContactPass& pass, void* blocks, std::uint32_t count);
    void (*store)(const void* block, LaneOutput& output);  // padding lanes need manifolds too
  };
  const char* name;
  std::uint32_t width;
  OfKind kind[kContactKinds];
  // Rows [begin, end), both multiples of kMaxWidth. The second also warm starts: it applies again
  // all that changed the velocities after the integration of the substep before.
  void (*integrate_velocities)(const ContactPass& pass, std::uint32_t begin, std::uint32_t end);
  void (*integrate_and_repeat)(const ContactPass& pass, std::uint32_t begin, std::uint32_t end);
  void (*integrate_positions)(const ContactPass& pass, std::uint32_t begin, std::uint32_t end);
};

// Scalar lanes, no SIMD: the reference. Widths 1 and 16; null for others.
const ContactKernels* reference_kernels(std::uint32_t width);

// The widest kernels this machine can run. Any thread.
const ContactKernels* best_kernels();

// Every SIMD kernel this machine can run, widest first, null-terminated. For tests and benchmarks:
// not while another thread dispatches.
const ContactKernels* const* simd_kernels();

}  // namespace skerry::solver
