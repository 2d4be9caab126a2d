// results.json, the page made from it, and comparisons with an earlier one.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>

#include "apps/report/baseline.h"
#include "apps/report/report.h"
#include "tests/apps/program.h"
#include "tests/scenes/json_schema.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

using report::Json;

// One real run for all tests.
class Report : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch_ = std::make_unique<ScratchDirectory>();
    const Outcome outcome = run_skerry({"compare", "brick_wall", "--workers", "2", "--reps", "3",
                                        "--steps", "4", "--frames", "4", "--host-ms", "0,1",
                                        "--host-shape", "mixed", "--out", directory()});
    ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  }
  static void TearDownTestSuite() { scratch_.reset(); }

  static std::string directory() { return *scratch_ / "out"; }
  static std::string file(const std::string& name) { return directory() + "/" + name; }
  static Json results() { return Json::parse(read_file(file("results.json"))); }

  static std::unique_ptr<ScratchDirectory> scratch_;
};
std::unique_ptr<ScratchDirectory> Report::scratch_;

TEST_F(Report, results_obey_their_schema) {
  const auto schema =
      nlohmann::json::parse(read_file((source_dir() / "docs/results.schema.json").string()));
  auto document = nlohmann::json::parse(read_file(file("results.json")));
  EXPECT_EQ(schema_violation(schema, document), "");
  document["scenes"][0]["frames"][0]["frame_ms"].erase("p95");
  EXPECT_NE(schema_violation(schema, document), "");
}

TEST_F(Report, results_hold_all_rows) {
  const Json json = results();
  const Json& scene = json.at("scenes").at(0);
  std::set<std::string> labels;
  for (const Json& row : scene.at("throughput")) labels.insert(row.at("label"));
  for (const char* label : {"serial", "dedicated_thread", "dedicated_thread_jobs", "fork_join",
                            "job_system", "oneTBB flow graph", "std::thread fork-join"}) {
    EXPECT_TRUE(labels.contains(label)) << label;
  }
  EXPECT_EQ(scene.at("frames").size(), 10u);
  EXPECT_EQ(scene.at("settings").size(), 10u);
  EXPECT_EQ(scene.at("timelines").size(), 5u);
  EXPECT_EQ(json.at("scheduling").size(), scene.at("throughput").size());
}

TEST_F(Report, page_is_whole_and_alone) {
  const std::string page = read_file(file("report.html"));
  for (const char* part :
       {"id=answer", "id=trust", "id=\"brick_wall\"", "id=scheduling", "id=method", "id=reproduce",
        "class=gantt", "class=chart", "prefers-color-scheme", "@media print"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  for (const char* foreign : {"http://", "https://", "src=", "@import", "url("}) {
    EXPECT_EQ(page.find(foreign), std::string::npos) << foreign;
  }
  EXPECT_LT(page.find("id=answer"), page.find("id=trust"));
}

TEST_F(Report, page_escapes_what_comes_from_outside) {
  Json json = results();
  json["command"] = "skerry <script>alert(1)</script>";
  json["scenes"][0]["scene"] = "a\"><b";
  const std::string page = report::html(json);
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(page.find("a\"><b"), std::string::npos);
}

TEST_F(Report, page_of_an_interrupted_run_shows_what_there_is) {
  Json json = results();
  json["interrupted"] = true;
  for (const char* key : {"frames", "settings", "timelines", "recommendations"}) {
    json["scenes"][0][key] = Json::array();
  }
  EXPECT_NE(report::html(json).find("Interrupted"), std::string::npos);
  json["scenes"] = Json::array();
  json["scheduling"] = Json::array();
  EXPECT_NE(report::html(json).find("id=reproduce"), std::string::npos);
}

TEST_F(Report, traces_hold_threads_host_work_stages_and_waits) {
  const auto trace = nlohmann::json::parse(read_file(file("trace_brick_wall_job_system.json")));
  std::set<std::string> names, categories, threads;
  for (const auto& event : trace.at("traceEvents")) {
    if (event.at("ph") == "M") threads.insert(event.at("args").at("name"));
    if (event.at("ph") != "X") continue;
    names.insert(event.at("name"));
    categories.insert(event.at("cat"));
    EXPECT_GE(event.at("ts").get<double>(), 0);
    EXPECT_GE(event.at("dur").get<double>(), 0);
  }
  EXPECT_TRUE(threads.contains("main thread"));
  EXPECT_TRUE(names.contains("solve_islands"));
  EXPECT_TRUE(names.contains("host work"));
  EXPECT_EQ(categories, (std::set<std::string>{"host", "host_job", "physics", "show", "wait"}));
}

TEST_F(Report, nothing_changed_since_itself) {
  const report::BaselineComparison same = report::compare_with_baseline(results(), results(), 0);
  EXPECT_GT(same.compared, 20);
  EXPECT_TRUE(same.changes.empty());
}

// Steps and frames of job_system `factor` times as long, intervals with them.
Json slowed(Json json, double factor) {
  for (Json& row : json["scenes"][0]["frames"]) {
    if (row["label"] != "job_system") continue;
    for (const char* key : {"p95"})
      row["frame_ms"][key] = factor * row["frame_ms"][key].get<double>();
    for (Json& end : row["frame_ms"]["p95_interval"]) end = factor * end.get<double>();
  }
  return json;
}

TEST_F(Report, a_change_beyond_noise_is_found_and_judged) {
  const Json before = results();
  const auto slower = report::compare_with_baseline(before, slowed(before, 1000), 0.05);
  EXPECT_EQ(slower.changes.size(), 2u);  // two host loads
  EXPECT_TRUE(slower.regressed());
  const auto faster = report::compare_with_baseline(slowed(before, 1000), before, 0.05);
  EXPECT_EQ(faster.changes.size(), 2u);
  EXPECT_FALSE(faster.regressed());
  // Within the tolerance, however sure.
  EXPECT_TRUE(report::compare_with_baseline(before, slowed(before, 1000), 1e6).changes.empty());
}

TEST_F(Report, another_machine_is_compared_by_speed_up_alone) {
  Json other = results();
  other["machine"]["cpu"] = "another";
  const auto changes = report::compare_with_baseline(other, slowed(results(), 1000), 0);
  EXPECT_FALSE(changes.same_machine);
  EXPECT_TRUE(changes.changes.empty());
  EXPECT_GT(changes.compared, 0);
}

TEST_F(Report, bad_baselines_are_refused) {
  EXPECT_THROW(report::compare_with_baseline(Json::object(), results(), 0), std::invalid_argument);
  const Outcome outcome = run_skerry({"compare", "tiny", "--baseline", "no/such.json"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "skerry: --baseline: cannot read no/such.json\n");
}

TEST_F(Report, a_regression_ends_with_status_1) {
  // Figures that no machine reaches.
  Json before = slowed(results(), 1e-6);
  write_file(file("old.json"), before.dump());
  const Outcome outcome =
      run_skerry({"compare", "brick_wall", "--workers", "2", "--reps", "3", "--steps", "4",
                  "--frames", "4", "--host-ms", "1", "--host-shape", "mixed", "--modes-only",
                  "--out", file("again"), "--baseline", file("old.json")});
  EXPECT_EQ(outcome.status, 1) << outcome.out;
  EXPECT_NE(outcome.out.find("WORSE  brick_wall, job_system, 1 ms of host work: frame time p95"),
            std::string::npos)
      << outcome.out;
}

// What the page says of itself once it is open, by width.
std::string open_in_browser(const std::string& page, int width, const ScratchDirectory& scratch) {
  const std::string probe =
      "<script>addEventListener('load',()=>{document.title='overflow '+"
      "(document.documentElement.scrollWidth-document.documentElement.clientWidth)+' width '+"
      "innerWidth;});addEventListener('error',e=>document.body.dataset.error=e.message);</script>";
  const std::string copy = scratch / "page.html";
  // The window of a headless browser is not narrower than 500: a frame is.
  write_file(copy, read_file(page) + probe);
  const std::string outer = scratch / "outer.html";
  write_file(
      outer,
      "<iframe id=f src=page.html width=" + std::to_string(width) +
          " height=3000 style=border:0></iframe><script>addEventListener('load',()=>{const "
          "d=f.contentDocument;document.body.append(d.title+' error:'+(d.body.dataset.error||"
          "'none'));});</script>");
  const std::string command =
      "chromium --headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
      "--disable-background-networking --disable-component-update --disable-sync "
      "--allow-file-access-from-files --enable-logging=stderr --user-data-dir=" +
      (scratch / "profile") + " --dump-dom file://" + outer + " >" + (scratch / "dom") + " 2>" +
      (scratch / "log");
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(scratch / "log").find("CONSOLE"), std::string::npos)
      << read_file(scratch / "log");
  return read_file(scratch / "dom");
}

TEST_F(Report, opens_in_a_browser_on_phone_and_desk_without_overflow_or_errors) {
  if (std::system("command -v chromium >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "chromium is not installed (./dev setup browser)";
  }
  for (const int width : {360, 1400}) {
    const ScratchDirectory scratch;
    const std::string dom = open_in_browser(file("report.html"), width, scratch);
    EXPECT_NE(dom.find("overflow 0 width " + std::to_string(width) + " error:none"),
              std::string::npos)
        << dom.substr(0, 2000);
  }
}

}  // namespace
}  // namespace skerry::test
