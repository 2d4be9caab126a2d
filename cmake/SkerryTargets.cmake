# Sources are globbed, so adding a file to a room needs no edit here.

# Sets OUT to the .cpp files of the current directory; files named *_simd.cpp get their flags.
function(skerry_glob_sources OUT)
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # gcc 12 warns falsely about its own AVX-512 intrinsics.
    foreach(source IN LISTS sources)
      if(source MATCHES "_simd\\.cpp$")
        set_source_files_properties("${source}" PROPERTIES
          COMPILE_OPTIONS "-Wno-maybe-uninitialized;-Wno-uninitialized")
      endif()
    endforeach()
  endif()
  set(${OUT} ${sources} PARENT_SCOPE)
endfunction()

# skerry_add_room(core PUBLIC a b PRIVATE c): static library skerry_core from the *.cpp beside it.
# A room without a .cpp yet is an interface library that passes its public links on.
function(skerry_add_room NAME)
  cmake_parse_arguments(PARSE_ARGV 1 ROOM "" "" "PUBLIC;PRIVATE")
  set(target skerry_${NAME})
  skerry_glob_sources(sources)
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE ${ROOM_PRIVATE})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_link_libraries(${target} ${scope} ${ROOM_PUBLIC})
  target_compile_features(${target} ${scope} cxx_std_20)
  # Rooms say "room/header.h" among themselves; only <skerry/...> is installed.
  target_include_directories(${target} ${scope} "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>")
  add_library(skerry::${NAME} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${NAME})
  set(SKERRY_ROOM_SCOPE ${scope} PARENT_SCOPE)  # for further target_... calls in the room
endfunction()

# skerry_add_program(hello_world LIBS ... [OUTPUT_NAME name] [TOP]): a program from the *.cpp
# beside it, or nothing when there is none yet. TOP puts it at the top of the build directory.
function(skerry_add_program NAME)
  cmake_parse_arguments(PARSE_ARGV 1 PROGRAM "TOP" "OUTPUT_NAME" "LIBS;EXCLUDE")
  skerry_glob_sources(sources)
  foreach(pattern IN LISTS PROGRAM_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX "${pattern}")
  endforeach()
  if(NOT sources)
    return()
  endif()
  add_executable(${NAME} ${sources})
  target_link_libraries(${NAME} PRIVATE ${PROGRAM_LIBS})
  target_include_directories(${NAME} PRIVATE "${PROJECT_SOURCE_DIR}")
  if(PROGRAM_OUTPUT_NAME)
    set_target_properties(${NAME} PROPERTIES OUTPUT_NAME ${PROGRAM_OUTPUT_NAME})
  endif()
  if(PROGRAM_TOP)
    set_target_properties(${NAME} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}")
  endif()
endfunction()
