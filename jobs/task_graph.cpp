#include <skerry/jobs/task_graph.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace skerry::jobs {
namespace {

// The data because of which two stages may not overlap.
std::uint64_t conflicts(const Stage& a, const Stage& b) {
  return (a.writes & (b.reads | b.writes)) | (a.reads & b.writes);
}

void check(const Stage& stage) {
  const auto refuse = [&](const char* why) {
    throw std::invalid_argument(std::string("stage '") + (stage.name ? stage.name : "") + "' " +
                                why);
  };
  if (!stage.name) refuse("has no name");
  if (!stage.kernel) refuse("has no kernel");
  if (!stage.count && stage.domain != kOnce) refuse("has a domain but no item count");
  if (stage.chunk == 0) refuse("has chunks of 0 items");
}

}  // namespace

void TaskGraph::partition(Domain domain, std::uint64_t data) {
  if (partitioned_.size() <= domain) partitioned_.resize(domain + 1, 0);
  partitioned_[domain] |= data;
  links_.clear();
  for (std::uint32_t i = 0; i < stages_.size(); ++i) link(i);
}

void TaskGraph::stage(const Stage& stage) {
  check(stage);
  stages_.push_back(stage);
  link(static_cast<std::uint32_t>(stages_.size() - 1));
}

bool TaskGraph::depends(std::uint32_t later, std::uint32_t earlier) const {
  return earlier < later && conflicts(stages_[later], stages_[earlier]) != 0;
}

// Called in stage order: everything before `index` is linked already.
void TaskGraph::link(std::uint32_t index) {
  std::vector<std::uint32_t> dependencies;
  std::vector<bool> ancestors(index, false);
  for (std::uint32_t i = 0; i < index; ++i) {
    if (!depends(index, i)) continue;
    dependencies.push_back(i);
    ancestors[i] = true;
    for (std::uint32_t k = 0; k < i; ++k) {
      if (links_[i].ancestors[k]) ancestors[k] = true;
    }
  }
  links_.push_back({.head = index, .ancestors = std::move(ancestors)});
  if (may_follow(index, dependencies)) {
    const std::uint32_t head = links_[dependencies.back()].head;
    links_[index].head = head;
    links_[head].chain.push_back(index);
    return;
  }
  links_[index].chain.push_back(index);
  for (const std::uint32_t dependency : dependencies) {
    const bool implied =
        std::any_of(dependencies.begin(), dependencies.end(), [&](std::uint32_t other) {
          return other > dependency && links_[other].ancestors[dependency];
        });
    if (implied) continue;
    links_[dependency].successors.push_back(index);
    ++links_[index].wait_count;
  }
}

bool TaskGraph::may_follow(std::uint32_t index,
                           const std::vector<std::uint32_t>& dependencies) const {
  if (dependencies.empty()) return false;
  const std::uint32_t head = links_[dependencies.back()].head;
  if (stages_[index].domain != stages_[head].domain ||
      stages_[index].chunk != stages_[head].chunk) {
    return false;
  }
  return std::all_of(dependencies.begin(), dependencies.end(), [&](std::uint32_t dependency) {
    if (links_[dependency].head == head) return conflicts_stay_within_items(index, dependency);
    return dependency < head && bool(links_[head].ancestors[dependency]);
  });
}

bool TaskGraph::conflicts_stay_within_items(std::uint32_t later, std::uint32_t earlier) const {
  const Domain domain = stages_[later].domain;
  const std::uint64_t partitioned = domain < partitioned_.size() ? partitioned_[domain] : 0;
  return (conflicts(stages_[later], stages_[earlier]) & ~partitioned) == 0;
}

}  // namespace skerry::jobs
