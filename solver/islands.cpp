#include "solver/islands.h"

#include <algorithm>
#include <atomic>
#include <span>
#include <utility>

#include "core/assert.h"
#include "core/growth.h"
#include "jobs/blocks.h"
#include "jobs/share.h"
#include "solver/finalise.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using namespace core;

// Bytes that a group touches in each substep: the measure of both its cost and its fit in cache.
constexpr std::uint64_t kContactBytes = 340;
constexpr std::uint64_t kBodyBytes = 350;
constexpr std::uint64_t kJointBytes = 1000;
constexpr std::uint64_t kFreeBodyBytes = 400;      // by time: about that of a manifold
constexpr std::uint64_t kGroupBytes = 256 * 1024;  // half of a common L2
constexpr std::uint64_t kWideBytes = 512 * 1024;
constexpr std::uint32_t kFreeBodiesPerGroup = 256;

constexpr std::uint32_t kRowGrain = 2048;  // pairs that one block connects: some 10 us

enum class Role : std::uint8_t { still, awake, asleep, moving, out };

// What a body is to its partners.
Role role_of(const Bodies& bodies, BodyIndex body) {
  if (body == kNone) return Role::still;  // the world, to joints
  const std::uint32_t flags = bodies.flags[body];
  if (flags & kQuarantined || !(flags & kAlive)) return Role::out;
  if (flags & kDynamic) return flags & kAwake ? Role::awake : Role::asleep;
  if (flags & kDisturbed) return Role::moving;
  return flags & kKinematic && flags & kAwake ? Role::moving : Role::still;
}

// What a body must be to be solved, and the flags that tell.
constexpr std::uint32_t kSolved = kAlive | kDynamic | kAwake;
constexpr std::uint32_t kTells = kSolved | kQuarantined;

class IslandBuilder {
 public:
  IslandBuilder(const StepContext& step, Task& task)
      : task_(task),
        workers_(step.worker_count),
        bodies_(*step.bodies),
        table_(*step.contacts),
        joints_(*step.joints),
        sleepers_(*step.sleepers),
        islands_(*step.islands),
        scratch_(step.solver->islands),
        force_packed_(step.solver->never_wide),
        force_wide_(step.solver->always_wide) {}

  void run() {
    connect_awake();
    number_islands();
    count_members();
    place_members();
    forget_disturbed(bodies_);
  }

 private:
  // Repeats while bodies wake: a woken island brings contacts that were not active.
  void connect_awake() {
    SKERRY_ASSERT(std::is_sorted(table_.active.begin(), table_.active.end()),
                  "active pairs are out of order");
    const std::vector<std::uint32_t>* rows = &table_.active;
    while (true) {
      refresh_awake(bodies_);
      scratch_.sets.begin(bodies_.rows(), bodies_.awake, workers_ > 1);
      if (!connect_contacts(*rows) && !connect_joints()) break;
      scratch_.rows.resize(table_.pairs.size());
      for (std::uint32_t i = 0; i < scratch_.rows.size(); ++i) scratch_.rows[i] = i;
      rows = &scratch_.rows;
    }
  }

  bool is_solved(BodyIndex body) const { return (bodies_.flags[body] & kTells) == kSolved; }

  enum class Meeting : std::uint8_t { nothing, wakes, joined };
  // What it means that two bodies touch or are joined; `body` becomes one of them that is solved.
  Meeting meeting_of(BodyIndex a, BodyIndex b, BodyIndex& body) const {
    const Role ra = role_of(bodies_, a), rb = role_of(bodies_, b);
    if (ra == Role::out || rb == Role::out) return Meeting::nothing;
    if (ra == Role::asleep || rb == Role::asleep) {
      const Role other = ra == Role::asleep ? rb : ra;
      return other == Role::awake || other == Role::moving ? Meeting::wakes : Meeting::nothing;
    }
    if (ra != Role::awake && rb != Role::awake) return Meeting::nothing;
    body = ra == Role::awake ? a : b;
    return Meeting::joined;
  }

  // Of two bodies that meet, one of which is `solved`.
  void connect(BodyIndex a, BodyIndex b, BodyIndex solved) {
    scratch_.sets.add(solved);
    const BodyIndex other = solved == a ? b : a;
    if (other == kNone || !is_solved(other)) return;
    scratch_.sets.add(other);
    scratch_.sets.unite(a, b);
  }

  void wake(BodyIndex a, BodyIndex b) {
    wake_island(bodies_, sleepers_, role_of(bodies_, a) == Role::asleep ? a : b);
  }

  static bool acts(const ContactPair& pair) {
    // Most pairs do not touch: no branch depends on it.
    return (static_cast<unsigned>((pair.flags & (kTouching | kSensorPair)) == kTouching) &
            static_cast<unsigned>(pair.manifold_count > 0)) != 0;
  }

  // Whether a body woke.
  bool connect_contacts(const std::vector<std::uint32_t>& rows) {
    const auto count = static_cast<std::uint32_t>(rows.size());
    blocks_ = jobs::blocks_of(count, kRowGrain);
    if (scratch_.found.size() < blocks_) scratch_.found.resize(blocks_ + blocks_ / 2);
    std::atomic<bool> wakes = false;
    jobs::run_blocks(task_, blocks_, [&](std::uint32_t block, std::uint32_t) {
      if (!connect_block(rows, jobs::items_of(block, kRowGrain, count), scratch_.found[block]))
        wakes.store(true, std::memory_order_relaxed);
    });
    if (!wakes.load(std::memory_order_relaxed)) return false;
    BodyIndex body = kNone;
    for (const std::uint32_t row : rows) {
      const ContactPair& pair = table_.pairs[row];
      if (acts(pair) && meeting_of(pair.body_a, pair.body_b, body) == Meeting::wakes)
        wake(pair.body_a, pair.body_b);
    }
    return true;
  }

  // Lists the contacts of these rows, as far as they are solved. False if one of them wakes a body.
  bool connect_block(const std::vector<std::uint32_t>& rows, IndexRange range,
                     std::vector<FoundContact>& found) {
    std::uint32_t acting[kRowGrain];
    std::uint32_t count = 0;
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      acting[count] = rows[i];
      count += acts(table_.pairs[rows[i]]) ? 1 : 0;
    }
    found.clear();
    found.reserve(kRowGrain);
    bool complete = true;
    for (std::uint32_t i = 0; i < count; ++i) {
      const ContactPair& pair = table_.pairs[acting[i]];
      BodyIndex body = pair.body_a;
      const bool both = is_solved(pair.body_a) && is_solved(pair.body_b);  // as a rule
      const Meeting meeting = both ? Meeting::joined : meeting_of(pair.body_a, pair.body_b, body);
      if (meeting == Meeting::joined) {
        connect(pair.body_a, pair.body_b, body);
        for (std::uint32_t m = 0; m < pair.manifold_count; ++m)
          found.push_back({{pair.first_manifold + m, acting[i]}, body});
      }
      complete = complete && meeting != Meeting::wakes;
    }
    return complete;
  }

  // Whether a body woke; what woke is not connected yet.
  bool connect_joints() {
    scratch_.joints.clear();
    scratch_.joint_body.clear();
    bool woke = false;
    for (std::uint32_t row = 0; row < joints_.rows.size(); ++row) {
      const Joint& joint = joints_.rows[row];
      if (!joint.alive) continue;
      BodyIndex body = kNone;
      const Meeting meeting = meeting_of(joint.a, joint.b, body);
      if (meeting == Meeting::nothing) continue;
      if (meeting == Meeting::wakes) {
        wake(joint.a, joint.b);
        woke = true;
        continue;
      }
      if (woke) continue;
      connect(joint.a, joint.b, body);
      scratch_.joints.push_back(row);
      scratch_.joint_body.push_back(body);
    }
    return woke;
  }

  // Islands in ascending order of their lowest body, where their bodies begin, and the bodies that are
  // in none.
  void number_islands() {
    islands_.islands.clear();
    islands_.free_bodies.clear();
    if (scratch_.island.size() < bodies_.rows()) scratch_.island.resize(bodies_.rows());
    for (const BodyIndex body : bodies_.awake) {
      const BodyIndex parent = scratch_.sets.parent(body);
      if (parent == kNone) {
        if (role_of(bodies_, body) != Role::out) islands_.free_bodies.push_back(body);
        continue;
      }
      if (parent == body) {
        scratch_.island[body] = static_cast<std::uint32_t>(islands_.islands.size());
        islands_.islands.emplace_back();
      } else {
        scratch_.island[body] = scratch_.island[parent];  // it is lower, so it has its number
      }
      ++islands_.islands[scratch_.island[body]].body_count;
    }
    std::uint32_t first = 0;
    for (Island& island : islands_.islands) {
      island.first_body = first;
      first += island.body_count;
    }
    islands_.bodies.resize(first);
  }

  // Bodies to their islands and contacts counted, side by side; then every list has its place.
  void count_members() {
    parts_ = std::min(blocks_, workers_);
    const std::size_t count = islands_.islands.size();
    core::refill(scratch_.part_counts, parts_ * count, 0u);
    jobs::run_blocks(task_, 1 + parts_, [&](std::uint32_t block, std::uint32_t) {
      block == 0 ? distribute_bodies() : count_contacts(block - 1);
    });
    for (const BodyIndex body : scratch_.joint_body)
      ++islands_.islands[scratch_.island[body]].joint_count;
    std::uint32_t contact = 0, joint = 0;
    for (std::size_t i = 0; i < count; ++i) {
      Island& island = islands_.islands[i];
      island.first_contact = contact;
      for (std::uint32_t part = 0; part < parts_; ++part) {
        std::uint32_t& of_part = scratch_.part_counts[part * count + i];
        contact += std::exchange(of_part, contact);
      }
      island.contact_count = contact - island.first_contact;
      island.first_joint = joint;
      joint += std::exchange(island.joint_count, 0);
    }
    islands_.contacts.resize(contact);
    islands_.joints.resize(joint);
  }

  void place_members() {
    distribute_joints();
    jobs::run_blocks(task_, 1 + parts_, [&](std::uint32_t block, std::uint32_t) {
      block == 0 ? make_groups() : distribute_contacts(block - 1);
    });
  }

  void distribute_bodies() {
    for (const BodyIndex body : scratch_.slotted) scratch_.slot[body] = kNone;
    scratch_.slotted.clear();
    scratch_.slot.resize(bodies_.rows(), kNone);
    scratch_.next_body.clear();
    for (const Island& island : islands_.islands) scratch_.next_body.push_back(island.first_body);
    for (const BodyIndex body : bodies_.awake) {
      if (scratch_.sets.parent(body) == kNone) continue;
      const std::uint32_t place = scratch_.next_body[scratch_.island[body]]++;
      islands_.bodies[place] = body;
      set_slot(body, place);
    }
    scratch_.kinematics.clear();
    for (const BodyIndex body : islands_.free_bodies) {
      if (!bodies_.is(body, kKinematic)) continue;
      set_slot(body, kKinematicSlot | static_cast<std::uint32_t>(scratch_.kinematics.size()));
      scratch_.kinematics.push_back({body, bodies_.pose[body].center,
                                     bodies_.pose[body].orientation, bodies_.motion[body].linear,
                                     bodies_.motion[body].angular});
    }
  }

  void set_slot(BodyIndex body, std::uint32_t slot) {
    scratch_.slot[body] = slot;
    scratch_.slotted.push_back(body);
  }

  // Calls visit(island, contacts) for runs of the part's contacts that are of one island. Parts are
  // consecutive blocks.
  template <class Visit>
  void for_each_run(std::uint32_t part, const Visit& visit) const {
    const std::uint32_t end = jobs::Share::begin_of(part + 1, parts_, blocks_);
    for (std::uint32_t block = jobs::Share::begin_of(part, parts_, blocks_); block < end; ++block) {
      const std::vector<FoundContact>& found = scratch_.found[block];
      for (std::size_t first = 0, last = 0; first < found.size(); first = last) {
        const std::uint32_t island = scratch_.island[found[first].body];
        while (last < found.size() && scratch_.island[found[last].body] == island) ++last;
        visit(island, std::span(found).subspan(first, last - first));
      }
    }
  }

  void count_contacts(std::uint32_t part) {
    std::uint32_t* const counts = scratch_.part_counts.data() + part * islands_.islands.size();
    for_each_run(part, [&](std::uint32_t island, std::span<const FoundContact> run) {
      counts[island] += static_cast<std::uint32_t>(run.size());
    });
  }

  // In the order in which they were found.
  void distribute_contacts(std::uint32_t part) {
    std::uint32_t* const next = scratch_.part_counts.data() + part * islands_.islands.size();
    for_each_run(part, [&](std::uint32_t island, std::span<const FoundContact> run) {
      ContactRef* to = &islands_.contacts[next[island]];
      for (const FoundContact& contact : run) *to++ = contact.ref;
      next[island] += static_cast<std::uint32_t>(run.size());
    });
  }

  void distribute_joints() {
    for (std::size_t i = 0; i < scratch_.joints.size(); ++i) {
      Island& island = islands_.islands[scratch_.island[scratch_.joint_body[i]]];
      islands_.joints[island.first_joint + island.joint_count++] = scratch_.joints[i];
    }
  }

  static std::uint64_t cost_of(const Island& island) {
    return kContactBytes * island.contact_count + kBodyBytes * island.body_count +
           kJointBytes * island.joint_count;
  }

  void make_groups() {
    scratch_.groups.clear();
    IslandGroup open = {GroupKind::packed, 0, 0};
    std::uint64_t open_cost = 0;
    bool open_jointed = false;
    const auto close = [&] {
      if (open.count > 0) scratch_.groups.push_back({open, open_cost});
      open_cost = 0;
      open.count = 0;
    };
    for (std::uint32_t i = 0; i < islands_.islands.size(); ++i) {
      const std::uint64_t cost = cost_of(islands_.islands[i]);
      if ((cost > kWideBytes && !force_packed_) || force_wide_) {
        close();
        scratch_.groups.push_back({{GroupKind::wide, i, 1}, cost});
        continue;
      }
      // Islands with joints are warm started in another way: never in one group with the others.
      const bool jointed = islands_.islands[i].joint_count > 0;
      if (open_cost + cost > kGroupBytes || jointed != open_jointed) close();
      open_jointed = jointed;
      if (open.count == 0) open.first = i;
      ++open.count;
      open_cost += cost;
    }
    close();
    const auto free_count = static_cast<std::uint32_t>(islands_.free_bodies.size());
    for (std::uint32_t first = 0; first < free_count; first += kFreeBodiesPerGroup) {
      const std::uint32_t count = std::min(kFreeBodiesPerGroup, free_count - first);
      scratch_.groups.push_back({{GroupKind::free, first, count}, kFreeBodyBytes * count});
    }
    std::sort(scratch_.groups.begin(), scratch_.groups.end(), [](const auto& a, const auto& b) {
      if (a.cost != b.cost) return a.cost > b.cost;
      if (a.group.kind != b.group.kind) return a.group.kind < b.group.kind;
      return a.group.first < b.group.first;
    });
    islands_.groups.clear();
    for (const auto& entry : scratch_.groups) islands_.groups.push_back(entry.group);
  }

  Task& task_;
  std::uint32_t workers_;
  std::uint32_t blocks_ = 0, parts_ = 0;  // of the contacts; parts are what one worker sorts
  Bodies& bodies_;
  ContactTable& table_;
  Joints& joints_;
  Sleepers& sleepers_;
  Islands& islands_;
  IslandScratch& scratch_;
  bool force_packed_, force_wide_;
};

}  // namespace

void build_islands(const StepContext& step, IndexRange, Task& task) {
  IslandBuilder(step, task).run();
  if (!step.effects) return;
  core::refill(step.effects->bodies, step.bodies->rows(), BodyEffect{});
  core::refill(step.effects->contacts, step.contacts->manifolds.size(), ContactResidual{});
}

}  // namespace skerry::solver
