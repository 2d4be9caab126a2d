#include "solver/islands.h"

#include <algorithm>
#include <span>
#include <utility>

#include "core/assert.h"
#include "core/growth.h"
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

class IslandBuilder {
 public:
  explicit IslandBuilder(const StepContext& step)
      : bodies_(*step.bodies),
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
    distribute();
    set_slots();
    make_groups();
    forget_disturbed(bodies_);
  }

 private:
  // Repeats while bodies wake: a woken island brings contacts that were not active.
  void connect_awake() {
    sorted_active();
    const std::vector<std::uint32_t>* rows = &table_.active;
    while (true) {
      begin_connecting();
      bool woke = connect_contacts(*rows);
      woke = connect_joints() || woke;
      if (!woke) break;
      scratch_.rows.resize(table_.pairs.size());
      for (std::uint32_t i = 0; i < scratch_.rows.size(); ++i) scratch_.rows[i] = i;
      rows = &scratch_.rows;
    }
  }

  void sorted_active() {
    auto& active = table_.active;
    if (!std::is_sorted(active.begin(), active.end())) std::sort(active.begin(), active.end());
  }

  void begin_connecting() {
    refresh_awake(bodies_);
    const std::size_t rows = bodies_.rows();
    if (scratch_.parent.size() < rows) {
      scratch_.parent.resize(rows);
      scratch_.joined.resize(rows);
      scratch_.island.resize(rows);
    }
    for (BodyIndex body : bodies_.awake) {
      scratch_.parent[body] = body;
      scratch_.joined[body] = 0;
    }
    scratch_.contacts.clear();
    scratch_.contact_body.clear();
    scratch_.joints.clear();
    scratch_.joint_body.clear();
  }

  BodyIndex find(BodyIndex body) {
    auto& parent = scratch_.parent;
    while (parent[body] != body) {
      parent[body] = parent[parent[body]];
      body = parent[body];
    }
    return body;
  }
  // The lower root wins, so that an island's root is its lowest body.
  void unite(BodyIndex a, BodyIndex b) {
    a = find(a);
    b = find(b);
    if (a < b) {
      scratch_.parent[b] = a;
    } else {
      scratch_.parent[a] = b;
    }
  }

  enum class Meeting : std::uint8_t { nothing, woke, joined };
  // Connects two bodies that touch or are joined; `body` is a dynamic one of them.
  Meeting meet(BodyIndex a, BodyIndex b, BodyIndex& body) {
    const Role ra = role_of(bodies_, a), rb = role_of(bodies_, b);
    if (ra == Role::out || rb == Role::out) return Meeting::nothing;
    if (ra == Role::asleep || rb == Role::asleep) {
      const Role other = ra == Role::asleep ? rb : ra;
      if (other != Role::awake && other != Role::moving) return Meeting::nothing;
      wake_island(bodies_, sleepers_, ra == Role::asleep ? a : b);
      return Meeting::woke;
    }
    if (ra != Role::awake && rb != Role::awake) return Meeting::nothing;
    body = ra == Role::awake ? a : b;
    scratch_.joined[body] = 1;
    if (ra == Role::awake && rb == Role::awake) {
      scratch_.joined[b] = 1;
      unite(a, b);
    }
    return Meeting::joined;
  }

  // Most pairs do not touch: those that do are listed without a branch that depends on it.
  std::span<const std::uint32_t> touching(const std::vector<std::uint32_t>& rows) {
    std::vector<std::uint32_t>& found = scratch_.touching;
    found.resize(std::max(found.size(), rows.size()));
    std::size_t count = 0;
    for (const std::uint32_t row : rows) {
      const ContactPair& pair = table_.pairs[row];
      found[count] = row;
      count += static_cast<std::size_t>((pair.flags & (kTouching | kSensorPair)) == kTouching) &
               static_cast<std::size_t>(pair.manifold_count > 0);
    }
    return {found.data(), count};
  }

  bool connect_contacts(const std::vector<std::uint32_t>& rows) {
    bool woke = false;
    for (const std::uint32_t row : touching(rows)) {
      const ContactPair& pair = table_.pairs[row];
      BodyIndex body = kNone;
      const Meeting meeting = meet(pair.body_a, pair.body_b, body);
      woke = woke || meeting == Meeting::woke;
      if (meeting != Meeting::joined) continue;
      for (std::uint32_t i = 0; i < pair.manifold_count; ++i) {
        scratch_.contacts.push_back({pair.first_manifold + i, row});
        scratch_.contact_body.push_back(body);
      }
    }
    return woke;
  }

  bool connect_joints() {
    bool woke = false;
    for (std::uint32_t row = 0; row < joints_.rows.size(); ++row) {
      const Joint& joint = joints_.rows[row];
      if (!joint.alive) continue;
      BodyIndex body = kNone;
      const Meeting meeting = meet(joint.a, joint.b, body);
      woke = woke || meeting == Meeting::woke;
      if (meeting != Meeting::joined) continue;
      scratch_.joints.push_back(row);
      scratch_.joint_body.push_back(body);
    }
    return woke;
  }

  // Islands in ascending order of their lowest body; counts of their members.
  void number_islands() {
    islands_.islands.clear();
    islands_.free_bodies.clear();
    for (const BodyIndex body : bodies_.awake) {
      if (role_of(bodies_, body) != Role::awake || !scratch_.joined[body]) {
        if (role_of(bodies_, body) != Role::out) islands_.free_bodies.push_back(body);
        continue;
      }
      const BodyIndex root = find(body);
      if (root == body) {
        scratch_.island[body] = static_cast<std::uint32_t>(islands_.islands.size());
        islands_.islands.emplace_back();
      } else {
        scratch_.island[body] = scratch_.island[root];
      }
      ++islands_.islands[scratch_.island[body]].body_count;
    }
    for (const BodyIndex body : scratch_.contact_body) {
      ++islands_.islands[scratch_.island[body]].contact_count;
    }
    for (const BodyIndex body : scratch_.joint_body) {
      ++islands_.islands[scratch_.island[body]].joint_count;
    }
    std::uint32_t body = 0, contact = 0, joint = 0;
    for (Island& island : islands_.islands) {
      island.first_body = body;
      island.first_contact = contact;
      island.first_joint = joint;
      body += std::exchange(island.body_count, 0);
      contact += std::exchange(island.contact_count, 0);
      joint += std::exchange(island.joint_count, 0);
    }
    islands_.bodies.resize(body);
    islands_.contacts.resize(contact);
    islands_.joints.resize(joint);
  }

  // Members to their islands, each list in the order in which it was made.
  void distribute() {
    for (const BodyIndex body : bodies_.awake) {
      if (role_of(bodies_, body) != Role::awake || !scratch_.joined[body]) continue;
      Island& island = islands_.islands[scratch_.island[body]];
      islands_.bodies[island.first_body + island.body_count++] = body;
    }
    for (std::size_t i = 0; i < scratch_.contacts.size(); ++i) {
      Island& island = islands_.islands[scratch_.island[scratch_.contact_body[i]]];
      islands_.contacts[island.first_contact + island.contact_count++] = scratch_.contacts[i];
    }
    for (std::size_t i = 0; i < scratch_.joints.size(); ++i) {
      Island& island = islands_.islands[scratch_.island[scratch_.joint_body[i]]];
      islands_.joints[island.first_joint + island.joint_count++] = scratch_.joints[i];
    }
  }

  void set_slots() {
    for (const BodyIndex body : scratch_.slotted) scratch_.slot[body] = kNone;
    scratch_.slotted.clear();
    scratch_.slot.resize(bodies_.rows(), kNone);
    for (std::uint32_t i = 0; i < islands_.bodies.size(); ++i) {
      scratch_.slot[islands_.bodies[i]] = i;
      scratch_.slotted.push_back(islands_.bodies[i]);
    }
    scratch_.kinematics.clear();
    for (const BodyIndex body : islands_.free_bodies) {
      if (!bodies_.is(body, kKinematic)) continue;
      scratch_.slot[body] = kKinematicSlot | static_cast<std::uint32_t>(scratch_.kinematics.size());
      scratch_.slotted.push_back(body);
      scratch_.kinematics.push_back({body, bodies_.pose[body].center,
                                     bodies_.pose[body].orientation, bodies_.motion[body].linear,
                                     bodies_.motion[body].angular});
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

  Bodies& bodies_;
  ContactTable& table_;
  Joints& joints_;
  Sleepers& sleepers_;
  Islands& islands_;
  IslandScratch& scratch_;
  bool force_packed_, force_wide_;
};

}  // namespace

void build_islands(const StepContext& step, IndexRange, Task&) {
  IslandBuilder(step).run();
  if (!step.effects) return;
  core::refill(step.effects->bodies, step.bodies->rows(), BodyEffect{});
  core::refill(step.effects->contacts, step.contacts->manifolds.size(), ContactResidual{});
}

}  // namespace skerry::solver
