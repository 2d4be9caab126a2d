// The contact kernels of every instruction set of this machine against the scalar reference: each
// kernel by itself, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/bodies.h"
#include "solver/contact_blocks.h"
#include "tests/support/rounds.h"

namespace skerry::solver {
namespace {

using core::Manifold;
using core::Q4f;
using core::Sym3f;
using core::V3f;

// Not a multiple of any width: the last block of each kind has padding lanes.
constexpr std::uint32_t kContacts = 37;  // of each kind
constexpr std::uint32_t kKinematic = 3;
constexpr std::uint32_t kDynamicEnd = 1 + 2 * kContacts * kContactKinds;
constexpr std::uint32_t kRows = (kDynamicEnd + kKinematic + kMaxWidth - 1) / kMaxWidth * kMaxWidth;

// By what the velocities, impulses and separations are multiplied, and the inverse masses.
struct Magnitudes {
  const char* name;
  float motion, inv_mass;
  bool finite;  // no velocity overflows
};
constexpr Magnitudes kMagnitudes[] = {
    {"usual", 1, 1, true},
    {"subnormal_motion", 1e-39f, 1, true},
    {"subnormal_impulses", 1e-30f, 1e9f, true},
    {"huge_motion", 1e6f, 1, true},
    {"heavy_bodies", 1, 1e-9f, true},
    {"overflowing_motion", 1e30f, 1, false},
};

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  float between(float low, float high) {
    return low + (high - low) * static_cast<float>(engine_() >> 8) * 0x1p-24f;
  }
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(engine_() % count); }
  V3f in_box(float half) {
    const float x = between(-half, half), y = between(-half, half), z = between(-half, half);
    return {x, y, z};
  }
  V3f unit() {
    const V3f v = in_box(1);
    const float length = std::sqrt(core::dot(v, v));
    return length < 0.1f ? V3f{0, 1, 0} : v * (1 / length);
  }

 private:
  std::mt19937 engine_;
};

struct Contact {
  Manifold manifold;
  std::uint32_t row_a = 0, row_b = 0;
  V3f offset{0, 0, 0};
};

// Contacts of one colour: no two share a body that they move.
struct Colour {
  std::vector<VelocityRow> velocity, start, forced;
  std::vector<DeltaRow> delta;
  std::vector<MassRow> mass;
  std::vector<BaseRow> base;
  std::vector<SpinRow> spin;
  std::vector<Contact> contacts[kContactKinds];
};

// Diagonally dominant, hence positive definite.
Sym3f random_inertia(Random& random, float scale) {
  Sym3f m;
  m.xx = scale * random.between(1, 3);
  m.yy = scale * random.between(1, 3);
  m.zz = scale * random.between(1, 3);
  m.xy = scale * random.between(-0.4f, 0.4f);
  m.xz = scale * random.between(-0.4f, 0.4f);
  m.yz = scale * random.between(-0.4f, 0.4f);
  return m;
}

void add_rows(Random& random, const Magnitudes& magnitudes, Colour& colour) {
  colour.velocity.resize(kRows);
  colour.forced.resize(kRows);
  colour.delta.resize(kRows);
  colour.mass.resize(kRows);
  colour.base.resize(kRows);
  colour.spin.resize(kRows);
  for (std::uint32_t row = 0; row < kRows; ++row) {
    const bool dynamic = row - 1 < kDynamicEnd - 1, moves = row > 0;
    VelocityRow& velocity = colour.velocity[row] = {};
    DeltaRow& delta = colour.delta[row] = {};
    MassRow& mass = colour.mass[row] = {};
    BaseRow& base = colour.base[row] = {};
    SpinRow& spin = colour.spin[row] = {};
    delta.rotation = base.orientation = Q4f{0, 0, 0, 1};
    spin.linear_factor = spin.angular_factor = 1;
    if (moves) {
      velocity.linear = random.in_box(5 * magnitudes.motion);
      velocity.angular = random.in_box(5 * magnitudes.motion);
      delta.translation = random.in_box(0.01f * magnitudes.motion);
      const V3f turn = random.in_box(0.05f);
      delta.rotation = Q4f{turn.x, turn.y, turn.z, std::sqrt(1 - core::dot(turn, turn))};
    }
    if (dynamic) {
      const float inv_mass = magnitudes.inv_mass * std::exp2(random.between(-6, 3));
      mass.inv_mass = inv_mass;
      mass.inv_inertia = random_inertia(random, 5 * inv_mass);
      mass.lock_flags = random.below(4) == 0 ? random.below(64) << core::kLockShift : 0;
      base.acceleration = random.in_box(10 * magnitudes.motion);
      base.patch_lever = random.below(3) ? random.between(0, 0.1f) : 0;
      spin.angular_acceleration = random.in_box(magnitudes.motion);
      spin.linear_factor = random.below(2) ? 1 : random.between(0.9f, 1);
      spin.angular_factor = random.below(2) ? 1 : random.between(0.9f, 1);
      spin.gyroscopic = random.below(3) == 0 ? 1 : 0;
      const Sym3f inertia = random_inertia(random, 0.1f / inv_mass);
      const float rows[6] = {inertia.xx, inertia.xy, inertia.xz,
                             inertia.yy, inertia.yz, inertia.zz};
      std::copy(std::begin(rows), std::end(rows), spin.inertia);
    }
    colour.forced[row] = velocity;
  }
  colour.start = colour.velocity;
}

Manifold random_manifold(Random& random, const Magnitudes& magnitudes, ContactKind kind) {
  const bool one = kind == ContactKind::point1 || kind == ContactKind::point1_full;
  const bool full = kind == ContactKind::points4_full || kind == ContactKind::point1_full;
  const float motion = magnitudes.motion, impulse = motion / magnitudes.inv_mass;
  Manifold m;
  m.normal = random.below(3) == 0 ? V3f{0, random.below(2) ? 1.0f : -1.0f, 0} : random.unit();
  m.point_count = one ? 1 : 1 + random.below(4);
  const V3f side = random.unit();
  const V3f u = side - m.normal * core::dot(side, m.normal), v = core::cross(m.normal, u);
  const V3f center = random.in_box(0.5f);
  const bool on_a_line = random.below(5) == 0;
  for (std::uint32_t i = 0; i < m.point_count; ++i) {
    const float x = (i == 0 || i == 3 ? 0.5f : -0.5f) + random.between(-0.1f, 0.1f);
    const float y = (i < 2 ? 0.5f : -0.5f) + random.between(-0.1f, 0.1f);
    m.points[i] = {center + u * x + v * (on_a_line ? 0 : y),
                   motion * random.between(-0.02f, 0.01f)};
    m.normal_impulse[i] = random.below(3) ? impulse * random.between(0, 0.1f) : 0;
  }
  m.friction_impulse = random.in_box(0.02f * impulse);
  m.twist_impulse = impulse * random.between(-0.01f, 0.01f);
  m.friction = random.below(5) ? random.between(0, 1) : 0;
  m.carried_impulse = impulse * random.between(0, 0.1f);
  m.rounding_a = random.below(2) ? random.between(0, 0.5f) : 0;
  m.rounding_b = random.below(2) ? random.between(0, 0.5f) : 0;
  if (full) {
    m.restitution = random.below(3) ? random.between(0, 1) : 0;
    m.rolling_resistance = random.below(3) ? random.between(0, 0.1f) : 0;
    m.rolling_impulse = random.in_box(0.002f * impulse);
  }
  return m;
}

Colour random_colour(std::uint32_t seed, const Magnitudes& magnitudes) {
  Random random(seed);
  Colour colour;
  add_rows(random, magnitudes, colour);
  std::uint32_t row = 1;
  const auto not_moved = [&] {
    const std::uint32_t k = random.below(1 + kKinematic);
    return k == 0 ? 0 : kDynamicEnd - 1 + k;
  };
  for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
    for (std::uint32_t i = 0; i < kContacts; ++i, row += 2) {
      Contact contact{random_manifold(random, magnitudes, static_cast<ContactKind>(kind)), row,
                      row + 1, random.in_box(1)};
      const std::uint32_t which = random.below(6);
      if (which == 0) contact.row_a = not_moved();
      if (which == 1) contact.row_b = not_moved();
      colour.contacts[kind].push_back(contact);
    }
  }
  return colour;
}

// A colour on its way through one table of kernels.
class Run {
 public:
  Run(const ContactKernels& kernels, const Colour& colour) : kernels_(kernels), colour_(colour) {
    const ContactKernels& widest = *reference_kernels(kMaxWidth);
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      memory_[kind].resize(block_count() * kernels.kind[kind].block_bytes / sizeof(Line));
      slots_[kind] = widest.kind[kind].block_bytes / (sizeof(float) * kMaxWidth);
    }
    pass_.velocity = colour_.velocity.data();
    pass_.start = colour_.start.data();
    pass_.forced = colour_.forced.data();
    pass_.delta = colour_.delta.data();
    flown_.resize(kRows);
    pass_.flown = flown_.data();
    pass_.mass = colour_.mass.data();
    pass_.base = colour_.base.data();
    pass_.spin = colour_.spin.data();
    pass_.dynamic_end = kDynamicEnd;
    pass_.substep = 1.0f / 240;
    pass_.inv_substep = 240;
    pass_.substeps = 3;
    pass_.max_push = 3;
    pass_.restitution_threshold = 0.5f;
    pass_.soft = {30, 0.8f, 0.2f};
    pass_.soft_load = 5;
  }

  template <class Result>
  void each(Result (*ContactKernels::OfKind::*kernel)(const ContactPass&, const LaneInput&,
                                                      void*)) {
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      for (std::uint32_t block = 0; block < block_count(); ++block) {
        LaneInput input;
        for (std::uint32_t lane = 0; lane < kernels_.width; ++lane) {
          fill(input, lane, contact_at(kind, block, lane));
        }
        (kernels_.kind[kind].*kernel)(pass_, input, block_at(kind, block));
      }
    }
  }

  using Pass = void (*ContactKernels::OfKind::*)(const ContactPass&, void*, std::uint32_t);
  void each(Pass kernel, bool books = true, bool last = false) {
    pass_.books = books;
    pass_.last = last;
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      (kernels_.kind[kind].*kernel)(pass_, block_at(kind, 0), block_count());
    }
  }

  using Integration = void (*ContactKernels::*)(const ContactPass&, std::uint32_t, std::uint32_t);
  void rows(Integration kernel) { (kernels_.*kernel)(pass_, 0, kRows); }

  // Bodies come elsewhere than the substeps have brought them.
  void fly() {
    flown_ = colour_.delta;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      core::V3f& way = flown_[row].translation;
      way = way + colour_.velocity[row].linear * 0.01f;
    }
  }

  void store() {
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      for (std::uint32_t block = 0; block < block_count(); ++block) {
        LaneOutput output;
        Manifold sink;
        for (std::uint32_t lane = 0; lane < kernels_.width; ++lane) {
          Contact* contact = contact_at(kind, block, lane);
          output.manifold[lane] = reinterpret_cast<float*>(contact ? &contact->manifold : &sink);
        }
        kernels_.kind[kind].store(block_at(kind, block), output);
        for (std::uint32_t lane = 0; lane < kernels_.width; ++lane) {
          if (!contact_at(kind, block, lane)) continue;
          stored_.push_back(output.push[lane]);
          stored_.push_back(output.torque[lane]);
          stored_.push_back({{output.bounced[lane], output.struck[lane], 0}, 0});
        }
      }
    }
  }

  // All there is, as bits, in an order that does not depend on the width; every NaN is the same.
  std::vector<std::uint32_t> words() const {
    std::vector<std::uint32_t> all;
    append(all, colour_.velocity);
    append(all, colour_.start);
    append(all, colour_.forced);
    append(all, colour_.delta);
    append(all, flown_);
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      for (std::uint32_t i = 0; i < kContacts; ++i) append_lane(all, kind, i);
      for (const Contact& contact : colour_.contacts[kind]) {
        append(all, &contact.manifold, sizeof(Manifold));
      }
    }
    append(all, stored_);
    return all;
  }

 private:
  struct alignas(64) Line {
    std::byte bytes[64] = {};
  };
  std::byte* bytes_of(std::uint32_t kind) {
    return reinterpret_cast<std::byte*>(memory_[kind].data());
  }
  const std::byte* bytes_of(std::uint32_t kind) const {
    return reinterpret_cast<const std::byte*>(memory_[kind].data());
  }

  std::uint32_t block_count() const { return (kContacts + kernels_.width - 1) / kernels_.width; }
  std::byte* block_at(std::uint32_t kind, std::uint32_t block) {
    return bytes_of(kind) + block * kernels_.kind[kind].block_bytes;
  }
  Contact* contact_at(std::uint32_t kind, std::uint32_t block, std::uint32_t lane) {
    const std::uint32_t i = block * kernels_.width + lane;
    return i < kContacts ? &colour_.contacts[kind][i] : nullptr;
  }

  void fill(LaneInput& input, std::uint32_t lane, const Contact* contact) const {
    static const Contact padding = [] {
      Contact empty;
      empty.manifold.normal = {0, 1, 0};
      return empty;
    }();
    if (!contact) contact = &padding;
    input.manifold[lane] = reinterpret_cast<const float*>(&contact->manifold);
    input.row_a[lane] = contact->row_a;
    input.row_b[lane] = contact->row_b;
    const float offset[3] = {contact->offset.x, contact->offset.y, contact->offset.z};
    for (std::uint32_t k = 0; k < 3; ++k) {
      input.offset[k][lane] = offset[k];
      input.inv_mass_a[k][lane] = inv_mass(contact->row_a, k);
      input.inv_mass_b[k][lane] = inv_mass(contact->row_b, k);
    }
    fill_side(contact->row_a, lane, input.inertia_a, input.angular_a);
    fill_side(contact->row_b, lane, input.inertia_b, input.angular_b);
    // Untimed, from the start of the step, and later.
    input.touch[lane] =
        contact->row_a % 3 == 0 ? -1 : 0.002f * static_cast<float>(contact->row_a % 3 - 1);
    for (std::uint32_t k = 0; k < 4; ++k)
      input.gap[k][lane] = 0.004f * static_cast<float>((contact->row_b + k) % 4);
    input.slowest[lane] = contact->row_b % 2 == 0 ? 0.5f : 0.1f;
    for (std::uint32_t k = 0; k < 3; ++k) input.shift[k][lane] = 0.01f * offset[k];
    input.held[lane] = contact->row_b % 2 == 0 ? 1 : 0;
  }
  void fill_side(std::uint32_t row, std::uint32_t lane, float (&inertia)[6][kMaxWidth],
                 float (&angular)[3][kMaxWidth]) const {
    const core::Sym3f& m = colour_.mass[row].inv_inertia;
    const float six[6] = {m.xx, m.xy, m.xz, m.yy, m.yz, m.zz};
    for (int k = 0; k < 6; ++k) inertia[k][lane] = six[k];
    const core::V3f& w = colour_.start[row].angular;
    const float three[3] = {w.x, w.y, w.z};
    for (int k = 0; k < 3; ++k) angular[k][lane] = three[k];
  }
  float inv_mass(std::uint32_t row, std::uint32_t axis) const {
    const MassRow& mass = colour_.mass[row];
    return mass.lock_flags & (core::kLockX << axis) ? 0 : mass.inv_mass;
  }

  static void append(std::vector<std::uint32_t>& all, const void* from, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; i += 4) {
      float value;
      std::uint32_t word;
      std::memcpy(&value, static_cast<const std::byte*>(from) + i, 4);
      if (std::isnan(value)) value = std::numeric_limits<float>::quiet_NaN();
      std::memcpy(&word, &value, 4);
      all.push_back(word);
    }
  }
  template <class Row>
  static void append(std::vector<std::uint32_t>& all, const std::vector<Row>& rows) {
    append(all, rows.data(), rows.size() * sizeof(Row));
  }
  // A block is rows of `width` lanes, four bytes each, and nothing else up to its end's alignment.
  void append_lane(std::vector<std::uint32_t>& all, std::uint32_t kind,
                   std::uint32_t contact) const {
    const std::uint32_t width = kernels_.width;
    const std::byte* block = bytes_of(kind) + contact / width * kernels_.kind[kind].block_bytes;
    for (std::size_t slot = 0; slot < slots_[kind]; ++slot) {
      append(all, block + 4 * (slot * width + contact % width), 4);
    }
  }

  const ContactKernels& kernels_;
  Colour colour_;
  std::vector<DeltaRow> flown_;
  ContactPass pass_;
  std::vector<Line> memory_[kContactKinds];
  std::size_t slots_[kContactKinds];
  std::vector<LaneOutput::Row> stored_;
};

struct AfterKernel {
  std::string kernel;
  std::vector<std::uint32_t> words;
};

// A step of three substeps, with every kernel.
std::vector<AfterKernel> history(const ContactKernels& kernels, const Colour& colour) {
  using OfKind = ContactKernels::OfKind;
  Run run(kernels, colour);
  std::vector<AfterKernel> all = {{"nothing", run.words()}};
  const auto note = [&](const char* kernel) { all.push_back({kernel, run.words()}); };
  run.each(&OfKind::prepare);
  note("prepare");
  for (int substep = 0; substep < 3; ++substep) {
    if (substep == 0) {
      run.rows(&ContactKernels::integrate_velocities);
      note("integrate_velocities");
      run.each(&OfKind::warm_start);
      note("warm_start");
    } else {
      run.rows(&ContactKernels::integrate_and_repeat);
      note("integrate_and_repeat");
    }
    run.each(&OfKind::solve);
    note("solve");
    run.rows(&ContactKernels::integrate_positions);
    note("integrate_positions");
    run.each(&OfKind::relax, substep != 1, substep == 2);
    note("relax");
  }
  run.each(&OfKind::restitute);
  note("restitute");
  run.each(&OfKind::count_pushes);
  run.each(&OfKind::count_pushes);  // as if the bodies had other contacts too
  note("count_pushes");
  run.each(&OfKind::strike);
  note("strike");
  run.each(&OfKind::take_back);
  note("take_back");
  run.each(&OfKind::reflect);
  note("reflect");
  run.store();
  note("store");
  run.fly();
  run.each(&OfKind::part);
  note("part");
  return all;
}

// Every table but the scalar one.
std::vector<const ContactKernels*> wide_kernels() {
  std::vector<const ContactKernels*> all = {reference_kernels(16)};
  for (const auto* list = simd_kernels(); *list; ++list) all.push_back(*list);
  return all;
}

class ContactKernelsOn : public testing::TestWithParam<Magnitudes> {};

TEST_P(ContactKernelsOn, give_the_bits_of_one_lane) {
  for (int round = 0; round < test::rounds(40); ++round) {
    const Colour colour = random_colour(static_cast<std::uint32_t>(round), GetParam());
    const auto expected = history(*reference_kernels(1), colour);
    for (const ContactKernels* kernels : wide_kernels()) {
      const auto got = history(*kernels, colour);
      ASSERT_EQ(got.size(), expected.size());
      for (std::size_t i = 0; i < got.size(); ++i) {
        const auto& a = got[i].words;
        const auto& b = expected[i].words;
        ASSERT_EQ(a.size(), b.size());
        const auto differs = std::mismatch(a.begin(), a.end(), b.begin()).first;
        ASSERT_EQ(differs, a.end()) << kernels->name << ": " << got[i].kernel << ", word "
                                    << differs - a.begin() << ", round " << round;
      }
    }
  }
}

TEST_P(ContactKernelsOn, overflow_only_where_meant_to) {
  int overflown = 0;
  for (int round = 0; round < test::rounds(10); ++round) {
    const Colour colour = random_colour(static_cast<std::uint32_t>(round), GetParam());
    const auto steps = history(*reference_kernels(1), colour);
    const auto& words = steps.back().words;  // the velocities come first
    overflown += static_cast<int>(
        std::count_if(words.begin(), words.begin() + kRows * sizeof(VelocityRow) / 4,
                      [](std::uint32_t word) { return (word & 0x7f800000u) == 0x7f800000u; }));
  }
  EXPECT_EQ(overflown == 0, GetParam().finite) << overflown;
}

std::string name_of(const testing::TestParamInfo<Magnitudes>& tested) { return tested.param.name; }
INSTANTIATE_TEST_SUITE_P(Magnitudes, ContactKernelsOn, testing::ValuesIn(kMagnitudes), name_of);

// So that equal bits say something.
TEST(ContactKernels, all_do_something) {
  const auto steps = history(*reference_kernels(1), random_colour(1, kMagnitudes[0]));
  for (std::size_t i = 1; i < steps.size(); ++i) {
    EXPECT_TRUE(steps[i].words != steps[i - 1].words) << steps[i].kernel;
  }
}

}  // namespace
}  // namespace skerry::solver
