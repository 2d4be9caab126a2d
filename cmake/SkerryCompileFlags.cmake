set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O3 -g -DNDEBUG")

# Determinism: the same bits from gcc and clang, at every optimisation level and SIMD width. Never
# -ffast-math, never -march. The two -fno flags change no result; they let loops vectorise.
add_compile_options(-ffp-contract=off -fno-math-errno -fno-trapping-math)
# Paths in binaries relative to the root: reproducible builds.
add_compile_options("-ffile-prefix-map=${PROJECT_SOURCE_DIR}/=")

add_compile_options(
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wdouble-promotion
  -Wcast-align -Wmissing-declarations -Wno-psabi
  # Designated initialisers that leave fields at their default are how our API is called.
  -Wno-missing-field-initializers)
if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  # Kernels combine conditions with & on purpose: no branches, and the same source for SIMD masks.
  add_compile_options(-Wno-bitwise-instead-of-logical)
endif()
if(SKERRY_WERROR)
  add_compile_options(-Werror)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Flow-based guesses with false positives inside inlined Eigen code: shown, never fatal.
    add_compile_options(-Wno-error=maybe-uninitialized -Wno-error=array-bounds
                        -Wno-error=stringop-overflow -Wno-error=stringop-overread
                        -Wno-error=free-nonheap-object -Wno-error=restrict)
  endif()
endif()

if(SKERRY_SANITIZE)
  add_compile_options(-fsanitize=${SKERRY_SANITIZE} -fno-sanitize-recover=all
                      -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SKERRY_SANITIZE})
endif()
