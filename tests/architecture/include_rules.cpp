#include "tests/architecture/include_rules.h"

#include <algorithm>
#include <fstream>
#include <regex>

namespace skerry::test {
namespace {

// One row per group of files; the first row whose `files` matches a path is its rule. Patterns are
// regular expressions for the whole path. Standard headers are always allowed, but for `denied`.
struct Rule {
  const char* files;
  const char* ours;         // headers of the project that may be included
  const char* third_party;  // other headers, beyond the standard library
  const char* denied;       // exceptions to the two above, and to the standard library
  const char* reason;       // said with every violation
};

constexpr const char* kThreading =
    "thread|mutex|shared_mutex|condition_variable|future|semaphore|latch|barrier|stop_token|"
    "pthread.h";
constexpr const char* kPosix =
    "unistd\\.h|sched\\.h|pthread\\.h|signal\\.h|sys/.*|linux/.*|fcntl\\.h";

const std::string kKernelDenied =
    std::string(kThreading) + "|jobs/(.*executor.*|tbb_.*|serial.*|fork_join.*|job_system.*)";
const std::string kJobsThirdParty = kPosix;
const std::string kTbbThirdParty = std::string("tbb/.*|oneapi/.*|") + kPosix;
const std::string kPipelineThirdParty = std::string("Eigen/.*|zstd\\.h|xxhash\\.h|") + kPosix;
const std::string kProgramThirdParty =
    std::string("Eigen/.*|CLI/.*|fmt/.*|nlohmann/.*|zstd\\.h|malloc\\.h|") + kPosix;
const std::string kModesThirdParty = kProgramThirdParty + "|benchmark/.*";
const std::string kPeersThirdParty =
    kProgramThirdParty + "|bt.*\\.h|Bullet.*|LinearMath/.*|ode/.*|bullet/.*";

const char* const kJobsApi = "skerry/(jobs\\.h|jobs/.*|error\\.h)";
const std::string kJobsOurs = std::string("jobs/.*|core/(assert|clock|growth)\\.h|") + kJobsApi;

const std::vector<Rule>& rules() {
  static const std::vector<Rule> kRules = {
      {"include/skerry/(jobs\\.h|jobs/.*)", kJobsApi, "", "",
       "skerry::jobs is usable alone: its headers include the standard library and each other"},
      {"include/.*", "skerry/.*", "Eigen/.*", "",
       "public headers include <skerry/...>, the standard library and Eigen"},
      {"core/.*", "skerry/.*|core/.*", "Eigen/.*|xxhash\\.h", kThreading,
       "core includes include/skerry, core and Eigen; no threads, no scheduling"},
      {"jobs/tbb_[^/]*\\.cpp", kJobsOurs.c_str(), kTbbThirdParty.c_str(), "",
       "jobs knows no physics: <skerry/jobs...>, core's assert, clock and growth, and "
       "jobs"},
      {"jobs/.*", kJobsOurs.c_str(), kJobsThirdParty.c_str(), "",
       "jobs knows no physics: <skerry/jobs...>, core's assert, clock and growth, and "
       "jobs; "
       "oneTBB in jobs/tbb_*.cpp only"},
      {"collision/fcl_[^/]*", "skerry/.*|core/.*|jobs/.*|collision/.*",
       "Eigen/.*|fcl/.*|octomap/.*|ccd/.*", kKernelDenied.c_str(),
       "collision includes core, jobs (no executor, no threads) and FCL"},
      {"collision/.*", "skerry/.*|core/.*|jobs/.*|collision/.*", "Eigen/.*|hwy/.*|emmintrin\\.h",
       kKernelDenied.c_str(),
       "collision includes core and jobs (no executor, no threads); FCL in collision/fcl_* only"},
      {"solver/.*", "skerry/.*|core/.*|jobs/.*|solver/.*", "Eigen/.*|hwy/.*", kKernelDenied.c_str(),
       "solver includes core and jobs (no executor, no threads), never collision: contacts are "
       "core "
       "data"},
      {"pipeline/.*", "skerry/.*|(core|jobs|collision|solver|pipeline)/.*",
       kPipelineThirdParty.c_str(), "collision/fcl_.*|jobs/tbb_.*",
       "pipeline includes the rooms before it, zstd and xxhash; FCL stays inside collision, oneTBB "
       "inside jobs"},
      {"scenes/.*", "skerry/.*|scenes/.*", "Eigen/.*|nlohmann/.*|assimp/.*", "",
       "scenes uses the public API: <skerry/...> and scenes"},
      {"apps/embed_jobs_only/.*", "skerry/(jobs\\.h|jobs/.*)|apps/embed_jobs_only/.*", kPosix, "",
       "this example shows skerry::jobs alone"},
      {"apps/schedulers/.*",
       "skerry/.*|apps/schedulers/.*|jobs/(machine|recorder|run_state)\\.h|"
       "pipeline/threading_mode\\.h",
       "oneapi/.*|omp\\.h", "",
       "other schedulers for the step: executors on skerry::jobs' own parts and foreign libraries"},
      {"apps/.*", "skerry/.*|scenes/.*|apps/.*|cmake/build_info/.*", kProgramThirdParty.c_str(), "",
       "programs use the public API: <skerry/...> and scenes"},
      {"bench/modes/.*",
       "skerry/.*|scenes/.*|bench/(modes|support)/.*|apps/measure/.*|cmake/build_info/.*",
       kModesThirdParty.c_str(), "",
       "bench/modes uses the public API: <skerry/...>, scenes and apps/measure"},
      {"bench/accuracy/.*", "skerry/.*|scenes/.*|apps/measure/.*", kProgramThirdParty.c_str(), "",
       "bench/accuracy uses the public API: <skerry/...>, scenes and apps/measure"},
      {"bench/peers/.*", "skerry/.*|scenes/.*|bench/(peers|support)/.*|cmake/build_info/.*",
       kPeersThirdParty.c_str(), "", "bench/peers uses the public API: <skerry/...> and scenes"},
      {"(bench|tests|cmake)/.*", ".*", ".*", "", ""},
  };
  return kRules;
}

bool matches(const std::string& text, const std::string& pattern) {
  return !pattern.empty() && std::regex_match(text, std::regex(pattern));
}

bool is_ours(const std::string& path) {
  return matches(path,
                 "(skerry|core|jobs|collision|solver|pipeline|scenes|apps|bench|tests|cmake)/.*");
}

// <vector>, <cmath>, but not <zstd.h> or <tbb/task_arena.h>.
bool is_standard(const Include& include) {
  return !include.quoted && include.path.find_first_of("/.") == std::string::npos;
}

}  // namespace

std::string violation(const Include& include) {
  const auto& table = rules();
  const auto rule = std::find_if(table.begin(), table.end(),
                                 [&](const Rule& row) { return matches(include.file, row.files); });
  if (rule == table.end()) return "is in no room: add a row to the rules";

  const std::string& path = include.path;
  const std::string names = include.quoted ? '"' + path + '"' : '<' + path + '>';
  if (matches(path, rule->denied)) return "includes " + names + ": " + rule->reason;
  if (is_standard(include)) return "";
  if (is_ours(path)) {
    const bool is_public = path.starts_with("skerry/");
    if (is_public == include.quoted) {
      return "includes " + names + ": <skerry/...> goes in angle brackets, room headers in quotes";
    }
    return matches(path, rule->ours) ? "" : "includes " + names + ": " + rule->reason;
  }
  if (matches(path, rule->third_party)) return "";
  if (include.quoted) return "includes " + names + ": room headers are named from the root";
  return "includes " + names + ": " + rule->reason;
}

std::vector<Include> includes_of(const std::filesystem::path& root, const std::string& file) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"].*)");
  std::vector<Include> found;
  std::ifstream input(root / file);
  std::string text;
  for (int line = 1; std::getline(input, text); ++line) {
    std::smatch match;
    if (std::regex_match(text, match, kInclude)) {
      found.push_back({file, line, match[2], match[1] == "\""});
    }
  }
  return found;
}

std::vector<std::string> source_files(const std::filesystem::path& root) {
  namespace fs = std::filesystem;
  std::vector<std::string> files;
  for (const char* folder : {"include", "core", "jobs", "collision", "solver", "pipeline", "scenes",
                             "apps", "bench", "tests", "cmake"}) {
    if (!fs::exists(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const auto extension = entry.path().extension();
      if (entry.is_regular_file() && (extension == ".h" || extension == ".cpp")) {
        files.push_back(fs::relative(entry.path(), root).generic_string());
      }
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace skerry::test
