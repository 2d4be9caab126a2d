// Runs the skerry program of this build.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace skerry::test {

struct Outcome {
  int status = -1;  // exit status; -1: killed
  std::string out, err;
};

// Interrupts it (SIGINT) after so many milliseconds; 0: never.
Outcome run_skerry(const std::vector<std::string>& arguments, int interrupt_after_ms = 0);

// A directory that goes away with the object.
class ScratchDirectory {
 public:
  ScratchDirectory();
  ~ScratchDirectory();
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

std::string read_file(const std::string& file);
void write_file(const std::string& file, const std::string& text);

// `skerry run arguments --json -`; fails the test unless it exits with 0.
nlohmann::json run_to_json(std::vector<std::string> arguments);

}  // namespace skerry::test
