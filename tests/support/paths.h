#pragma once

#include <filesystem>

namespace skerry::test {

std::filesystem::path source_dir();  // root of the source tree
std::filesystem::path program();     // the skerry program of this build, whether built or not

}  // namespace skerry::test
