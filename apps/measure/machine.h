// The machine and the build, as they go into result files.
#pragma once

#include <string>

namespace skerry::measure {

struct Machine {
  std::string cpu;       // model name
  int cores = 0;         // that the process may use
  std::string simd;      // widest instruction set of the processor that we have kernels for
  std::string system;    // kernel, and the hypervisor if there is one
  std::string compiler;  // "GNU 12.2.0"
  std::string flags;
  std::string commit;
};

Machine this_machine();

}  // namespace skerry::measure
