// Command line values and their checks, shared by the commands.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <skerry/settings.h>

#include "apps/measure/host_load.h"
#include "scenes/scene.h"

namespace skerry::app {

inline constexpr int kMaxWorkers = 1024;

// Wrong input that the command line parser cannot know to be wrong; what() is one line.
class BadInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws BadInput, with the names there are.
ThreadingMode parse_mode(const std::string& name);
SolverKind parse_solver(const std::string& name);
// "spread", "none", or both with a comma.
std::vector<Affinity> parse_affinities(const std::string& list);
measure::HostShape parse_host_shape(const std::string& name);
// "1,2,0"; 0: automatic.
std::vector<int> parse_workers(const std::string& list);

// As scenes::load_scene; throws BadInput or SceneError.
scenes::SceneDesc load(const std::string& name, const std::optional<std::uint64_t>& seed = {});

// "0,2,4,8", each from 0 to `most`; throws BadInput naming the option.
std::vector<double> parse_numbers(const std::string& option, const std::string& list, double most,
                                  const std::string& unit);

// Writes text to a file, or to standard output for "-". Throws BadInput if it cannot be written.
void write_text(const std::string& file, const std::string& text);
// Fails now rather than after minutes of measuring.
void check_writable(const std::string& file);

}  // namespace skerry::app
