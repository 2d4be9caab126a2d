# cmake -D BUILD=... -D SOURCE=... -D PROJECT=... -D SCRATCH=... ... -P install_and_use.cmake
# Installs BUILD into SCRATCH/prefix, builds PROJECT against that alone, and runs its programs.
function(must)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\n${output}\nstatus ${status}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE "${SCRATCH}")
must(${CMAKE_COMMAND} --install "${BUILD}" --prefix "${SCRATCH}/prefix")
must(${CMAKE_COMMAND} -S "${PROJECT}" -B "${SCRATCH}/build" -G "${GENERATOR}"
  "-DCMAKE_CXX_COMPILER=${CXX}" "-DCMAKE_BUILD_TYPE=${BUILD_TYPE}"
  "-DCMAKE_PREFIX_PATH=${SCRATCH}/prefix" "-DSKERRY_EXAMPLES=${SOURCE}/apps")
must(${CMAKE_COMMAND} --build "${SCRATCH}/build")
file(STRINGS "${SCRATCH}/build/programs.txt" programs)
if(NOT programs)
  message(FATAL_ERROR "${PROJECT} names no programs")
endif()
foreach(program IN LISTS programs)
  must("${SCRATCH}/build/${program}")
  message("${program}:\n${output}")
endforeach()
