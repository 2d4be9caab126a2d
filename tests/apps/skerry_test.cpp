// The command line is a contract: exit statuses, messages and JSON keys.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/apps/program.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

using nlohmann::json;

void expect_refused(const std::vector<std::string>& arguments, const std::string& message) {
  const Outcome outcome = run_skerry(arguments);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "skerry: " + message + "\n");
}

TEST(Skerry, bad_usage_ends_with_2_and_one_line) {
  expect_refused({}, "A subcommand is required (see skerry --help)");
  expect_refused({"fly"}, "unknown command 'fly' (see skerry --help)");
  expect_refused({"cmpare"},
                 "unknown command 'cmpare' (did you mean \"compare\"?) (see skerry --help)");
  expect_refused({"run"}, "SCENE is required (see skerry --help)");
  expect_refused({"run", "tiny", "--bogus"},
                 "The following argument was not expected: --bogus (see skerry --help)");
  expect_refused({"run", "tiny", "--steps", "-1"},
                 "--steps: Value -1 not in range 1 to 1000000000 (see skerry --help)");
  expect_refused({"run", "tiny", "--workers", "two"},
                 "--workers: Value two not in range 0 to 1024 (see skerry --help)");
  expect_refused({"run", "tiny", "--dt", "nan"}, "--dt: must be between 1e-06 and 1 s, got nan");
  expect_refused({"run", "tiny", "--mode", "forkjoin"},
                 "--mode: must be one of serial, dedicated_thread, dedicated_thread_jobs, "
                 "fork_join, job_system, got 'forkjoin' (did you mean \"fork_join\"?)");
  expect_refused({"run", "tny"},
                 "unknown scene 'tny' (did you mean \"tiny\"?); `skerry scenes` lists them");
  expect_refused({"run", "no/such.json"}, "no/such.json: no such file");
  expect_refused({"run", "tiny", "--json", "/no/such/dir/a.json"},
                 "cannot write /no/such/dir/a.json: there is no directory /no/such/dir");
  expect_refused({"compare", "tiny", "--host-ms", "2,x"},
                 "--host-ms: must be milliseconds from 0 to 1000 with commas between, got '2,x'");
  expect_refused({"check", "no/such.json"}, "no/such.json: no such file");
  expect_refused({"check", ""}, "'': no such file");
  expect_refused({"run", "/"}, "/: is not a regular file");
  expect_refused({"run", "tiny", "--json", ""}, "--json: needs a name (see skerry --help)");
  expect_refused({"compare", "tiny", "--out", ""}, "--out: needs a name (see skerry --help)");
  expect_refused({"run", "tiny", "--hash-every", "-2"},
                 "--hash-every: Value -2 not in range 0 to 1000000000 (see skerry --help)");
  expect_refused({"run", "two\nlines"}, "unknown scene 'two lines'; `skerry scenes` lists them");
}

TEST(Skerry, files_that_are_no_text_end_with_2_and_one_line) {
  const ScratchDirectory scratch;
  const std::string file = scratch / "bad.json";
  for (const std::string& bytes :
       {std::string("\xff\xfe\x00\x01", 4), std::string(100, '\0'), std::string(),
        std::string(1'000'000, '['), std::string("{\"format\":\"skerry-scene\",\"version\":NaN}"),
        std::string("{\"format\":\"skerry-scene\",\"version\":1,\"a\\nb\":1}"),
        std::string("{\"format\":\"skerry-scene\",\"version\":1,\"name\":\"a\\u0000b\"}")}) {
    write_file(file, bytes);
    for (const char* command : {"check", "run"}) {
      const Outcome outcome = run_skerry({command, file});
      EXPECT_EQ(outcome.status, 2);
      EXPECT_EQ(outcome.out, "");
      EXPECT_TRUE(outcome.err.starts_with("skerry: " + file + ":1: ")) << outcome.err;
      EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    }
  }
}

TEST(Skerry, help_and_version_end_with_0) {
  EXPECT_EQ(run_skerry({"--help"}).status, 0);
  EXPECT_EQ(run_skerry({"run", "--help"}).status, 0);
  EXPECT_TRUE(run_skerry({"--version"}).out.starts_with("skerry "));
}

TEST(Skerry, check_says_what_is_wrong_and_where) {
  const ScratchDirectory scratch;
  const std::string file = scratch / "tower.json";
  write_file(file,
             "{ \"format\": \"skerry-scene\", \"version\": 1,\n  \"bodies\": [\n    { "
             "\"shapes\": [{ \"type\": \"sphere\", \"radius\": -0.5 }] } ] }");
  const std::string message = file + ":3: bodies[0].shapes[0].radius: must be positive, got -0.5";
  expect_refused({"check", file}, message);
  expect_refused({"run", file}, message);
}

TEST(Skerry, check_says_what_a_file_holds) {
  const std::string file = (source_dir() / "scenes/data/brick_wall.json").string();
  const Outcome outcome = run_skerry({"check", file});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_TRUE(outcome.out.starts_with(file + ": ok\n")) << outcome.out;
  EXPECT_NE(outcome.out.find("196 bodies (194 dynamic, 2 fixed, 0 kinematic)"), std::string::npos);
  EXPECT_NE(outcome.out.find("4 events from step 30 to 280"), std::string::npos);
}

TEST(Skerry, scenes_lists_built_in_and_shipped_ones) {
  const Outcome outcome = run_skerry({"scenes", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  std::set<std::string> names;
  for (const json& row : json::parse(outcome.out)) names.insert(row.at("name"));
  for (const char* name : {"large_pyramid", "many_pyramids", "box_pile", "box_bricks",
                           "sphere_rain", "convex_pile", "islands", "tiny", "hills"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  const Outcome table = run_skerry({"scenes"});
  for (const std::string& name : names) {
    EXPECT_NE(table.out.find(name), std::string::npos) << name;
  }
}

TEST(SkerryRun, writes_every_key_of_the_contract) {
  const json run = run_to_json({"tiny", "--steps", "20", "--warmup", "5", "--hash-every", "10"});
  for (const char* key : {"scene",
                          "mode",
                          "workers",
                          "steps",
                          "dt",
                          "substeps",
                          "bodies",
                          "shapes",
                          "joints",
                          "contacts",
                          "islands",
                          "largest_island",
                          "step_ms",
                          "stages_ms",
                          "cpu_ms_per_step",
                          "peak_rss_mb",
                          "allocations_per_step",
                          "state_hash",
                          "hashes",
                          "penetration_mm",
                          "kinetic_energy_j",
                          "potential_energy_j",
                          "momentum",
                          "warnings",
                          "machine"}) {
    EXPECT_TRUE(run.contains(key)) << key;
  }
  for (const char* key : {"mean", "p50", "p95", "p99", "max"}) {
    EXPECT_TRUE(run.at("step_ms").at(key).is_number()) << key;
  }
  for (const char* key : {"cpu", "cores", "simd", "compiler", "flags", "commit"}) {
    EXPECT_TRUE(run.at("machine").contains(key)) << key;
  }
  EXPECT_TRUE(run.at("penetration_mm").contains("mean"));
  EXPECT_TRUE(run.at("penetration_mm").contains("max"));
  EXPECT_EQ(run.at("momentum").size(), 3u);
  EXPECT_EQ(run.at("scene"), "tiny");
  EXPECT_EQ(run.at("mode"), "serial");
  EXPECT_EQ(run.at("steps"), 20);
  EXPECT_EQ(run.at("bodies"), 21);
  EXPECT_TRUE(run.at("stages_ms").contains("narrowphase"));
  EXPECT_GT(run.at("step_ms").at("max").get<double>(), 0);
  EXPECT_GT(run.at("peak_rss_mb").get<double>(), 1);

  const std::string hash = run.at("state_hash");
  EXPECT_EQ(hash.size(), 18u);
  EXPECT_EQ(hash.substr(0, 2), "0x");
  ASSERT_EQ(run.at("hashes").size(), 2u);  // of steps 10 and 20; the warmup counts
  EXPECT_EQ(run.at("hashes")[1].at("step"), 20);
}

TEST(SkerryRun, measures_steps_on_request_and_without_a_change_of_state) {
  const json plain = run_to_json({"tiny", "--steps", "60"});
  const json run = run_to_json({"tiny", "--steps", "60", "--measure"});
  EXPECT_FALSE(plain.contains("measured"));
  EXPECT_EQ(run.at("state_hash"), plain.at("state_hash"));
  const json& measured = run.at("measured");
  const double gone =
      measured.at("energy_first_j").get<double>() - measured.at("energy_last_j").get<double>();
  EXPECT_GT(gone, 0);
  EXPECT_NEAR(measured.at("energy_lost_j").get<double>(), gone,
              0.02 * gone);  // and the first step's
  for (const char* law : {"cone", "normal", "friction"}) {
    EXPECT_TRUE(measured.at("law").at(law).at("max").is_number()) << law;
  }
  EXPECT_GT(run.at("contact_measures").at("normal_impulse").get<double>(), 0);
}

TEST(SkerryRun, solvers_are_chosen_by_name) {
  const json own = run_to_json({"tiny", "--steps", "60"});
  EXPECT_EQ(own.at("solver"), "soft_step_tgs");
  for (const char* solver : {"pgs", "penalty"}) {
    const json run = run_to_json({"tiny", "--steps", "60", "--solver", solver});
    EXPECT_EQ(run.at("solver"), solver);
    EXPECT_NE(run.at("state_hash"), own.at("state_hash"));
  }
  expect_refused({"run", "tiny", "--solver", "magic"},
                 "--solver: must be soft_step_tgs, pgs or penalty, got 'magic'");
}

TEST(SkerryRun, warmup_and_steps_make_one_history) {
  const json whole = run_to_json({"tiny", "--steps", "30"});
  const json parts = run_to_json({"tiny", "--warmup", "12", "--steps", "18"});
  EXPECT_EQ(parts.at("state_hash"), whole.at("state_hash"));
}

TEST(SkerryRun, seeds_substeps_and_dt_reach_the_world) {
  const json plain = run_to_json({"tiny", "--steps", "30"});
  EXPECT_EQ(run_to_json({"tiny", "--steps", "30", "--seed", "12345"}).at("state_hash"),
            plain.at("state_hash"));
  for (const std::vector<std::string>& change : std::vector<std::vector<std::string>>{
           {"--seed", "7"}, {"--substeps", "2"}, {"--dt", "0.02"}}) {
    std::vector<std::string> arguments = {"tiny", "--steps", "30"};
    arguments.insert(arguments.end(), change.begin(), change.end());
    EXPECT_NE(run_to_json(arguments).at("state_hash"), plain.at("state_hash")) << change[0];
  }
}

TEST(SkerryRun, every_mode_and_worker_count_makes_the_same_bits) {
  for (const char* scene : {"tiny", "brick_wall"}) {
    const std::vector<std::string> base = {scene, "--steps", "130", "--hash-every", "10"};
    const json serial = run_to_json(base);
    for (const char* mode :
         {"dedicated_thread", "dedicated_thread_jobs", "fork_join", "job_system"}) {
      for (const char* workers : {"1", "2", "3"}) {
        std::vector<std::string> arguments = base;
        arguments.insert(arguments.end(), {"--mode", mode, "--workers", workers});
        const json run = run_to_json(arguments);
        EXPECT_EQ(run.at("mode"), mode);
        EXPECT_EQ(run.at("hashes"), serial.at("hashes")) << scene << ' ' << mode << ' ' << workers;
        EXPECT_EQ(run.at("state_hash"), serial.at("state_hash"));
      }
    }
  }
}

// What `skerry run tiny` with two workers writes: its steps are 3, 4 and 5.
json trace_of_three_steps() {
  const ScratchDirectory scratch;
  const std::string file = scratch / "trace.json";
  const Outcome outcome = run_skerry({"run", "tiny", "--mode", "job_system", "--workers", "2",
                                      "--steps", "3", "--warmup", "2", "--trace", file});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  return json::parse(read_file(file));
}

TEST(SkerryRun, trace_holds_the_tasks_of_the_timed_steps) {
  const json trace = trace_of_three_steps();
  std::set<std::string> steps;
  bool narrowphase = false;
  std::map<int, double> end_us;  // [track] of the event before
  for (const json& event : trace.at("traceEvents")) {
    if (event.at("ph") != "X") continue;
    if (event.at("cat") == "step") steps.insert(event.at("name"));
    narrowphase = narrowphase || event.at("name") == "narrowphase";
    const double begin_us = event.at("ts"), duration_us = event.at("dur");
    EXPECT_GE(begin_us, end_us[event.at("tid")]);
    EXPECT_GE(duration_us, 0);
    end_us[event.at("tid")] = begin_us + duration_us;
  }
  EXPECT_EQ(steps, (std::set<std::string>{"step 3", "step 4", "step 5"}));
  EXPECT_TRUE(narrowphase);
}

// See TraceEvents for what each of these does in Perfetto or speedscope.
TEST(SkerryRun, trace_avoids_what_viewers_misread) {
  const json trace = trace_of_three_steps();
  EXPECT_FALSE(trace.contains("displayTimeUnit"));
  std::map<int, std::string> threads;
  std::map<std::string, int> times;  // [name and arguments] of tasks
  for (const json& event : trace.at("traceEvents")) {
    const int thread = event.at("tid");
    EXPECT_GT(thread, 0);
    if (event.at("name") == "thread_name") threads[thread] = event.at("args").at("name");
    if (event.at("name") == "process_name") {
      EXPECT_EQ(event.at("args").at("name"), "skerry: tiny, job_system");
    }
    if (event.at("ph") != "X") continue;
    EXPECT_TRUE(threads.contains(thread)) << "events before their thread's name";
    if (event.at("name") == "solve_islands") {
      ++times[event.at("name").get<std::string>() + event.at("args").dump()];
    }
  }
  ASSERT_EQ(threads.size(), 3u);
  EXPECT_EQ(threads.begin()->second, "worker 0 (makes the step)");
  EXPECT_EQ(threads.begin()->first, trace.at("traceEvents").at(0).at("pid"));
  ASSERT_FALSE(times.empty());
  for (const auto& [task, count] : times) EXPECT_GT(count, 1) << task << " is not added up";
}

TEST(SkerryRun, interruption_keeps_what_was_measured) {
  const ScratchDirectory scratch;
  const std::string file = scratch / "run.json";
  const Outcome outcome =
      run_skerry({"run", "tiny", "--steps", "1000000000", "--json", file}, 1500);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const json run = json::parse(read_file(file));
  EXPECT_EQ(run.at("interrupted"), true);
  EXPECT_GT(run.at("steps").get<int>(), 0);
}

TEST(SkerryCompare, holds_all_modes_against_serial) {
  const ScratchDirectory scratch;
  const Outcome outcome = run_skerry({"compare", "tiny", "brick_wall", "--steps", "40", "--reps",
                                      "2", "--host-ms", "0,1", "--frames", "5", "--workers", "2",
                                      "--modes-only", "--out", scratch / "new/results"});
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const json results = json::parse(read_file(scratch / "new/results/results.json"));
  EXPECT_EQ(results.at("format"), "skerry-compare");
  EXPECT_EQ(results.at("version"), 3);
  EXPECT_EQ(results.at("equal"), true);
  ASSERT_EQ(results.at("scenes").size(), 2u);
  for (const json& scene : results.at("scenes")) {
    EXPECT_EQ(scene.at("throughput_repetitions").at("made"), 3);
    EXPECT_EQ(scene.at("throughput").size(), 5u);
    EXPECT_EQ(scene.at("frames").size(), 10u);
    EXPECT_FALSE(scene.at("verdict").empty());
    for (const json& row : scene.at("throughput")) {
      EXPECT_EQ(row.at("equal"), true);
      EXPECT_EQ(row.at("state_hash"), scene.at("throughput")[0].at("state_hash"));
      EXPECT_GT(row.at("step_ms").at("p50").get<double>(), 0);
    }
  }
}

TEST(SkerryCompare, interruption_keeps_complete_repetitions) {
  const ScratchDirectory scratch;
  const Outcome outcome = run_skerry({"compare", "tiny", "--reps", "1000", "--steps", "20",
                                      "--modes-only", "--out", scratch / "out"},
                                     4000);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const json results = json::parse(read_file(scratch / "out/results.json"));
  EXPECT_EQ(results.at("interrupted"), true);
  EXPECT_GT(results.at("scenes").at(0).at("throughput_repetitions").at("made").get<int>(), 0);
  EXPECT_NE(read_file(scratch / "out/report.html").find("Interrupted"), std::string::npos);
}

}  // namespace
}  // namespace skerry::test
