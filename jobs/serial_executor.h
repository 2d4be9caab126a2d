// Runs everything on the calling thread, in stage order. The reference, and what every kind is with
// one worker.
#pragma once

#include <memory>

#include <skerry/jobs/executor.h>

namespace skerry::jobs {
std::unique_ptr<Executor> make_serial_executor();
}
