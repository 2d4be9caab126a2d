option(SKERRY_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(SKERRY_BUILD_BENCH "Build the benchmarks" ${PROJECT_IS_TOP_LEVEL})
option(SKERRY_BUILD_APPS "Build the skerry program and the examples" ${PROJECT_IS_TOP_LEVEL})
option(SKERRY_WERROR "Treat compiler warnings as errors" OFF)
option(SKERRY_ASSERTS "Compile SKERRY_ASSERT and SKERRY_VALIDATE in" OFF)
option(SKERRY_PCH "Precompile Eigen and GoogleTest headers, once for all tests" ON)
set(SKERRY_SANITIZE "" CACHE STRING "Sanitizers for -fsanitize=, for example address,undefined")
set(SKERRY_TEST_TIMEOUT_SCALE 1 CACHE STRING "Factor on every test's time limit (slow builds)")

if(SKERRY_BUILD_TESTS OR SKERRY_BUILD_BENCH OR SKERRY_BUILD_APPS)
  set(SKERRY_NEEDS_SCENES ON)
else()
  set(SKERRY_NEEDS_SCENES OFF)
endif()

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES AND PROJECT_IS_TOP_LEVEL)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

find_program(SKERRY_CCACHE ccache)
mark_as_advanced(SKERRY_CCACHE)
if(SKERRY_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Base directory: two checkouts share results. Sloppiness: what ccache's manual asks for with
  # precompiled headers.
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" CCACHE_NOHASHDIR=1
      "CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime"
      ${SKERRY_CCACHE})
endif()
