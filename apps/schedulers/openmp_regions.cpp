// Parallel loops by OpenMP, where the compiler has it. How its workers wait is its own affair
// (OMP_WAIT_POLICY).
#include "apps/schedulers/fork_join_regions.h"
#include "jobs/machine.h"

#ifdef _OPENMP
#include <omp.h>
#endif

namespace skerry::schedulers {

#ifdef _OPENMP
namespace {

class OpenMpRegions final : public Regions {
 public:
  explicit OpenMpRegions(const jobs::ExecutorSettings& settings)
      : workers_(settings.workers), spread_(settings.affinity == jobs::Affinity::spread) {}

  std::uint32_t workers() const override { return static_cast<std::uint32_t>(workers_); }

  void loop(std::uint32_t count, const Body& body) override {
#pragma omp parallel num_threads(workers_)
    {
      const auto worker = static_cast<std::uint32_t>(omp_get_thread_num());
      settle(worker);
#pragma omp for schedule(dynamic, 1)
      for (std::uint32_t i = 0; i < count; ++i) body(i, worker);
    }
  }

 private:
  // A thread that OpenMP starts inherits the caller's affinity, which may be pinned by then.
  void settle(std::uint32_t worker) const {
    if (worker == 0) return;
    jobs::settle_thread(spread_ ? processors_[worker % processors_.size()] : -1, processors_);
  }

  int workers_;
  bool spread_;
  std::vector<int> processors_ = jobs::allowed_processors();
};

}  // namespace

std::unique_ptr<Regions> make_openmp_regions(const jobs::ExecutorSettings& settings) {
  return std::make_unique<OpenMpRegions>(settings);
}
#else
std::unique_ptr<Regions> make_openmp_regions(const jobs::ExecutorSettings&) { return nullptr; }
#endif

}  // namespace skerry::schedulers
