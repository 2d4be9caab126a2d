# The programs that hold tests with label tsan.
add_custom_target(skerry_tsan_tests)

# skerry_add_tests(core [LIBS ...]): program skerry_test_core from the *.cpp beside it. Each test is
# a process of its own, but for the suites of IN_ONE_GO: what their cases share is long to make.
function(skerry_add_tests FOLDER)
  cmake_parse_arguments(PARSE_ARGV 1 TEST "" "TIMEOUT" "LIBS;EXCLUDE_SOURCES;IN_ONE_GO")
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 60)
  endif()
  skerry_glob_sources(sources)
  if(FOLDER STREQUAL "support")
    list(FILTER sources INCLUDE REGEX "_test\\.cpp$")
  endif()
  if(NOT sources)
    return()
  endif()
  set(target skerry_test_${FOLDER})
  if(FOLDER STREQUAL "support")
    set(target skerry_test_test_support)  # skerry_test_support is the library
  endif()
  add_executable(${target} ${sources})
  target_link_libraries(${target} PRIVATE skerry_test_support skerry_scenes ${TEST_LIBS}
                        GTest::gmock GTest::gtest_main Threads::Threads)
  if(SKERRY_PCH AND FOLDER STREQUAL "support")
    target_precompile_headers(${target} PRIVATE <Eigen/Geometry> <gtest/gtest.h> <string> <vector>)
  elseif(SKERRY_PCH)
    target_precompile_headers(${target} REUSE_FROM skerry_test_test_support)
  endif()

  foreach(source IN LISTS sources)
    file(STRINGS "${source}" named REGEX "StdThread|std_thread" LIMIT_COUNT 1)
    if(named)
      add_dependencies(skerry_tsan_tests ${target})
    endif()
  endforeach()
  set(tsan "*StdThread*:*std_thread*")
  set(stress "*Stress*:*stress*")
  set(apart "${tsan}:${stress}")
  math(EXPR long_timeout "${TEST_TIMEOUT} * 5")
  math(EXPR suite_timeout "${long_timeout} * ${SKERRY_TEST_TIMEOUT_SCALE}")
  foreach(suite IN LISTS TEST_IN_ONE_GO)
    string(APPEND apart ":${suite}.*")
    add_test(NAME ${suite} COMMAND ${target} "--gtest_filter=${suite}.*"
             WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}")
    set_tests_properties(${suite} PROPERTIES TIMEOUT ${suite_timeout} LABELS "${FOLDER}")
  endforeach()
  skerry_discover(${target} "-${apart}" ${TEST_TIMEOUT} "${FOLDER}")
  skerry_discover(${target} "${tsan}" ${TEST_TIMEOUT} "${FOLDER}-tsan")
  skerry_discover(${target} "${stress}-${tsan}" ${long_timeout} "${FOLDER}-stress")
endfunction()

# Sanitizers of clang 14 die at start on kernels that spread addresses further than they know of
# (sysctl vm.mmap_rnd_bits above 28), so their tests run without address randomisation wherever that
# may be turned off; some containers forbid it.
if(SKERRY_SANITIZE AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
  find_program(SKERRY_SETARCH setarch)
  mark_as_advanced(SKERRY_SETARCH)
  if(SKERRY_SETARCH)
    execute_process(COMMAND "${SKERRY_SETARCH}" -R ${CMAKE_COMMAND} -E true
                    RESULT_VARIABLE refused OUTPUT_QUIET ERROR_QUIET)
    if(NOT refused)
      set(CMAKE_CROSSCOMPILING_EMULATOR "${SKERRY_SETARCH}" -R)
    endif()
  endif()
endif()

# No values in names: some print addresses, which change from run to run.
function(skerry_discover TARGET FILTER TIMEOUT LABELS)
  math(EXPR timeout "${TIMEOUT} * ${SKERRY_TEST_TIMEOUT_SCALE}")
  gtest_discover_tests(${TARGET}
    TEST_FILTER "${FILTER}" NO_PRETTY_VALUES DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 300
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    PROPERTIES TIMEOUT ${timeout} LABELS "${LABELS}")
endfunction()
