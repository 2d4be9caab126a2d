#include "apps/measure/step_analysis.h"

#include <algorithm>
#include <map>

namespace skerry::measure {

double GraphBound::work_ms() const {
  double sum = 0;
  for (const Part& part : parts) sum += part.work_ms;
  return sum;
}

double GraphBound::critical_ms() const {
  double sum = 0;
  for (const Part& part : parts) sum += part.critical_ms;
  return sum;
}

double GraphBound::least_ms(int workers) const {
  double sum = 0;
  for (const Part& part : parts) {
    sum += std::max(part.critical_ms, part.work_ms / std::max(1, workers));
  }
  return sum;
}

double GraphBound::speed_up(int workers) const {
  const double least = least_ms(workers);
  return least > 0 ? work_ms() / least : 1;
}

void GraphBound::add(const GraphBound& other, double part) {
  parts.resize(std::max(parts.size(), other.parts.size()));
  for (std::size_t i = 0; i < other.parts.size(); ++i) {
    parts[i].work_ms += part * other.parts[i].work_ms;
    parts[i].critical_ms += part * other.parts[i].critical_ms;
  }
}

GraphBound graph_bound(std::span<const StageTime> stages, std::span<const jobs::TaskRecord> tasks) {
  std::map<std::string, std::size_t> chain_of;  // stage name to number of its chain
  std::size_t chains = 0;
  for (const StageTime& stage : stages) {
    if (!stage.per_item || chains == 0) ++chains;
    chain_of[stage.name] = chains - 1;
  }
  GraphBound bound;
  bound.parts.resize(chains);
  std::vector<std::map<std::uint32_t, std::int64_t>> by_item(chains);  // [chain] first item to ns
  for (const jobs::TaskRecord& task : tasks) {
    const std::size_t chain = chain_of[task.name];
    bound.parts[chain].work_ms += 1e-6 * static_cast<double>(task.end_ns - task.begin_ns);
    by_item[chain][task.first_item] += task.critical_ns;
  }
  for (std::size_t chain = 0; chain < chains; ++chain) {
    std::int64_t longest = 0;
    for (const auto& [item, ns] : by_item[chain]) longest = std::max(longest, ns);
    bound.parts[chain].critical_ms = 1e-6 * static_cast<double>(longest);
  }
  return bound;
}

std::vector<double> busy_ms_by_worker(std::span<const jobs::TaskRecord> tasks, int workers) {
  std::vector<double> busy(static_cast<std::size_t>(std::max(1, workers)), 0.0);
  for (const jobs::TaskRecord& task : tasks) {
    if (task.worker < busy.size()) {
      busy[task.worker] += 1e-6 * static_cast<double>(task.end_ns - task.begin_ns);
    }
  }
  return busy;
}

double imbalance(const std::vector<double>& busy_ms) {
  double sum = 0, most = 0;
  for (const double ms : busy_ms) {
    sum += ms;
    most = std::max(most, ms);
  }
  return sum > 0 ? most * static_cast<double>(busy_ms.size()) / sum : 1;
}

}  // namespace skerry::measure
