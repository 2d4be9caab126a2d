// Counting processors: affinity, cores and cgroup quotas, from made-up file systems.
#include "jobs/machine.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "jobs/worker_indices.h"

namespace skerry::jobs {
namespace {

namespace fs = std::filesystem;

class MachineTest : public testing::Test {
 protected:
  MachineTest()
      : root_(fs::path(testing::TempDir()) /
              ("machine_" +
               std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    fs::remove_all(root_);
  }
  ~MachineTest() override { fs::remove_all(root_); }

  void write(const std::string& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text << '\n';
  }
  fs::path root_;
};

TEST_F(MachineTest, no_cgroup_means_no_quota) { EXPECT_EQ(cgroup_processor_quota(root_), 0); }

TEST_F(MachineTest, v2_quotas_are_rounded_up) {
  write("proc/self/cgroup", "0::/");
  write("sys/fs/cgroup/cpu.max", "150000 100000");
  EXPECT_EQ(cgroup_processor_quota(root_), 2);
  write("sys/fs/cgroup/cpu.max", "20000 100000");
  EXPECT_EQ(cgroup_processor_quota(root_), 1);
  write("sys/fs/cgroup/cpu.max", "max 100000");
  EXPECT_EQ(cgroup_processor_quota(root_), 0);
}

TEST_F(MachineTest, the_tightest_group_above_the_process_counts) {
  write("proc/self/cgroup", "0::/outer/inner");
  write("sys/fs/cgroup/outer/inner/cpu.max", "max 100000");
  write("sys/fs/cgroup/outer/cpu.max", "300000 100000");
  write("sys/fs/cgroup/cpu.max", "800000 100000");
  EXPECT_EQ(cgroup_processor_quota(root_), 3);
}

TEST_F(MachineTest, a_path_of_the_host_falls_back_to_the_mount_point) {
  write("proc/self/cgroup", "0::/docker/abcdef");
  write("sys/fs/cgroup/cpu.max", "100000 100000");
  EXPECT_EQ(cgroup_processor_quota(root_), 1);
}

TEST_F(MachineTest, v1_quotas_count_and_minus_one_is_none) {
  write("proc/self/cgroup", "5:memory:/a\n4:cpu,cpuacct:/a\n0::/");
  write("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_quota_us", "250000");
  write("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_period_us", "100000");
  EXPECT_EQ(cgroup_processor_quota(root_), 3);
  write("sys/fs/cgroup/cpu,cpuacct/a/cpu.cfs_quota_us", "-1");
  EXPECT_EQ(cgroup_processor_quota(root_), 0);
}

TEST_F(MachineTest, threads_of_one_core_count_once) {
  const int cores[] = {0, 1, 0, 1};
  for (int i = 0; i < 4; ++i) {
    const std::string topology = "devices/system/cpu/cpu" + std::to_string(i) + "/topology/";
    write(topology + "core_id", std::to_string(cores[i]));
    write(topology + "physical_package_id", "0");
  }
  EXPECT_EQ(physical_cores({0, 1, 2, 3}, root_), 2);
  EXPECT_EQ(physical_cores({0, 2}, root_), 1);
  EXPECT_EQ(physical_cores({0, 1, 7}, root_), 3) << "one nobody knows of is a core";
}

TEST(Pinning, the_allowed_processors_do_not_change_while_pinned) {
  const auto before = allowed_processors();
  const PinScope outer(before.back());
  EXPECT_EQ(allowed_processors(), before);
  const PinScope inner(before.front());
  EXPECT_EQ(allowed_processors(), before);
}

TEST(WorkerIndicesTest, indices_are_unique_and_the_preferred_one_is_given_if_free) {
  WorkerIndices indices(70);
  EXPECT_EQ(indices.acquire(5), 5u);
  EXPECT_EQ(indices.acquire(5), 1u) << "the lowest free one";
  EXPECT_EQ(indices.acquire(0), 2u) << "0 is the caller's";
  for (int i = 0; i < 66; ++i) EXPECT_TRUE(indices.acquire(69));
  EXPECT_FALSE(indices.acquire(3));
  indices.release(69);
  EXPECT_EQ(indices.acquire(7), 69u);
}

}  // namespace
}  // namespace skerry::jobs
