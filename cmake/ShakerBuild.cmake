# Compiler settings and the two functions with which every room declares itself.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "" FORCE)
endif()
# The loops of estimator/math/simd_math.hpp are compiled for three instruction sets, and a program
# takes the best that its PC has. For one alone they compile in less than half of the time. Such a
# build is for trying the programs, as ./demo does: of it only the estimator is optimised as elsewhere.
set(SHAKER_INSTRUCTION_SET all CACHE STRING
    "all: runs on every x86-64 PC; x86-64-v3 or x86-64-v4: only to try, on those with this instruction set")
if(SHAKER_INSTRUCTION_SET STREQUAL "all")
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")
  set(SHAKER_QUICK_LEVEL -O1)
else()
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g0")
  set(SHAKER_ESTIMATOR_LEVEL $<$<CONFIG:RelWithDebInfo>:-O2>)
  set(SHAKER_QUICK_LEVEL -Og)
  add_compile_definitions(SHAKER_INSTRUCTION_SET="arch=${SHAKER_INSTRUCTION_SET}")
  install(CODE "message(FATAL_ERROR \"This build is for trying, on ${SHAKER_INSTRUCTION_SET} only. Configure \"
                                     \"it with -DSHAKER_INSTRUCTION_SET=all before you install it.\")")
endif()

option(SHAKER_WERROR "Warnings are errors" ON)
set(SHAKER_SANITIZE "" CACHE STRING "Sanitizers: 'address,undefined' or 'thread'")

# Fewer collections of the compiler's garbage: 6 % less time for 15 % more memory.
add_compile_options("$<$<CXX_COMPILER_ID:GNU>:SHELL:--param ggc-min-heapsize=1000000>")
add_compile_options(-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
                    -Wold-style-cast -Wdouble-promotion -Wformat=2 -Wcast-align)
if(SHAKER_WERROR)
  add_compile_options(-Werror)
endif()
# A program is bound to the shared libraries that it really uses, not to all that its rooms know.
add_link_options(-Wl,--as-needed)
find_program(MOLD mold)
if(MOLD)  # links a test program in a fifth of the time
  add_link_options(-fuse-ld=mold)
endif()
if(SHAKER_SANITIZE)
  # -O1: a third less time to build, and traces that can be read.
  add_compile_options(-O1 -fsanitize=${SHAKER_SANITIZE} -fno-omit-frame-pointer
                      -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${SHAKER_SANITIZE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    # Clang builds the rooms with -O2 in 2 % more time than with -O1, and a diagnosis takes 13 % less.
    # Without fused products: clang rounds a * b + c once where it knows the numbers, twice where it does not.
    # Loops that clear or copy a few numbers stay loops, whose accesses are checked in line: as calls that the
    # sanitizer intercepts they take a tenth of a diagnosis.
    add_compile_options(-O2 -ffp-contract=off -fno-builtin-memset -fno-builtin-memcpy
                        -fsanitize-ignorelist=${CMAKE_SOURCE_DIR}/cmake/not-ours.txt)
  endif()
endif()

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime,locale
      CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE})
endif()

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME runtime)

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(PkgConfig REQUIRED)

# Vectorised loops, no traps, no errno. Nothing here relies on NaN tests being kept out of order:
# -ffast-math is not used (it makes Eigen's small inverses wrong, see docs/estimation.md).
# g++ 12 would copy a Lanes in quarters, and what loads its halves behind that waits for them.
include(CheckCXXCompilerFlag)
check_cxx_compiler_flag("-mmove-max=256 -mstore-max=256" SHAKER_HAS_MOVE_MAX)
set(SHAKER_LOOP_OPTIONS -O3 -fno-math-errno -fno-trapping-math -Wno-psabi)
if(SHAKER_HAS_MOVE_MAX)
  list(APPEND SHAKER_LOOP_OPTIONS -mmove-max=256 -mstore-max=256)
endif()
# What nearly every file of the numerics includes, read once. Only for targets that link
# shaker_math, which has the kernels that eigen_kernels.hpp declares.
file(GENERATE OUTPUT headers.cpp CONTENT "// Only for its precompiled headers.\n")
add_library(shaker_headers OBJECT ${CMAKE_CURRENT_BINARY_DIR}/headers.cpp)
target_link_libraries(shaker_headers PRIVATE Threads::Threads fmt::fmt Eigen3::Eigen)
target_precompile_headers(shaker_headers PRIVATE
  <algorithm> <cmath> <functional> <limits> <memory> <numbers> <optional> <span> <stdexcept>
  <string> <vector> <fmt/format.h> ${CMAKE_SOURCE_DIR}/estimator/math/eigen_kernels.hpp)
# The same for rooms whose files read or write JSON.
file(GENERATE OUTPUT json_headers.cpp CONTENT "// Only for its precompiled headers.\n")
add_library(shaker_json_headers OBJECT ${CMAKE_CURRENT_BINARY_DIR}/json_headers.cpp)
target_link_libraries(shaker_json_headers PRIVATE Threads::Threads fmt::fmt
                                                  nlohmann_json::nlohmann_json)
target_precompile_headers(shaker_json_headers PRIVATE
  <algorithm> <filesystem> <functional> <map> <memory> <optional> <string> <string_view> <vector>
  <fmt/format.h> <nlohmann/json.hpp>)
# shaker_precompiled(NAME [json_headers])
function(shaker_precompiled name)
  set(headers headers)
  if(ARGC GREATER 1)
    set(headers ${ARGV1})
  endif()
  target_precompile_headers(shaker_${name} REUSE_FROM shaker_${headers})
endfunction()
# shaker_precompiled_target(TARGET): the same for a target that is no room.
function(shaker_precompiled_target target)
  target_precompile_headers(${target} REUSE_FROM shaker_headers)
endfunction()

# shaker_compile_quickly(TARGET...): for code that waits for a person, a file or a start. -O1 takes
# a sixth less time to compile than -O2, a third less where JSON documents are read or written, and
# -Og a seventh less than -O1.
function(shaker_compile_quickly)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE ${SHAKER_QUICK_LEVEL})
  endforeach()
endfunction()

# shaker_batches(TARGET [AT_MOST n] SOURCE...): compiles the files of one folder together, in batches
# of at most n files, or of SHAKER_BATCH. A template of Eigen or of the JSON library is then instantiated once a batch.
# A larger batch builds faster from nothing, a smaller one after a change of one file.
set(SHAKER_BATCH 10 CACHE STRING "Most files in one compiler process; 1: each for itself")
function(shaker_batches target)
  cmake_parse_arguments(arg "" "AT_MOST" "" ${ARGN})
  if(NOT arg_AT_MOST)
    set(arg_AT_MOST ${SHAKER_BATCH})
  endif()
  if(SHAKER_BATCH LESS 2)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  foreach(source IN LISTS arg_UNPARSED_ARGUMENTS)
    get_filename_component(folder ${source} DIRECTORY)
    string(MAKE_C_IDENTIFIER "of_${folder}" folder)
    list(APPEND folders ${folder})
    list(APPEND ${folder} ${source})
  endforeach()
  list(REMOVE_DUPLICATES folders)
  foreach(folder IN LISTS folders)
    list(LENGTH ${folder} count)
    math(EXPR batches "(${count} + ${arg_AT_MOST} - 1) / ${arg_AT_MOST}")
    math(EXPR size "(${count} + ${batches} - 1) / ${batches}")
    set(k 0)
    foreach(source IN LISTS ${folder})
      math(EXPR batch "${k} / ${size}")
      math(EXPR k "${k} + 1")
      if(size GREATER 1)
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder}_${batch})
      endif()
    endforeach()
  endforeach()
endfunction()

# shaker_library(NAME SOURCES a.cpp b.cpp [LOOPS c.cpp...] [DEPENDS targets...])
# A room's static library, target shaker_NAME, included from the project's root. LOOPS are files
# whose time goes into loops over points: they are compiled with SHAKER_LOOP_OPTIONS.
function(shaker_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LOOPS;DEPENDS" ${ARGN})
  add_library(shaker_${name} STATIC ${arg_SOURCES})
  shaker_batches(shaker_${name} ${arg_SOURCES})
  target_include_directories(shaker_${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>
                                                   $<INSTALL_INTERFACE:include>
                                                   $<INSTALL_INTERFACE:include/shaker>)
  target_compile_features(shaker_${name} INTERFACE cxx_std_20)
  target_link_libraries(shaker_${name} PUBLIC ${arg_DEPENDS})
  if(arg_LOOPS)
    add_library(shaker_${name}_loops OBJECT ${arg_LOOPS})
    shaker_batches(shaker_${name}_loops AT_MOST 6 ${arg_LOOPS})
    target_include_directories(shaker_${name}_loops PRIVATE ${CMAKE_SOURCE_DIR})
    target_link_libraries(shaker_${name}_loops PRIVATE ${arg_DEPENDS})
    target_compile_options(shaker_${name}_loops PRIVATE ${SHAKER_LOOP_OPTIONS})
    target_sources(shaker_${name} PRIVATE $<TARGET_OBJECTS:shaker_${name}_loops>)
  endif()
endfunction()

# --- tests. Each has its room as label: the folder below tests/. The file rooms.txt in the build
# folder says for .ci/rooms which targets a room's tests need: a line each, "ROOM TARGET".
file(WRITE ${CMAKE_BINARY_DIR}/rooms.txt "")
function(shaker_room_of_tests out)
  file(RELATIVE_PATH room ${CMAKE_SOURCE_DIR}/tests ${CMAKE_CURRENT_SOURCE_DIR})
  set(${out} ${room} PARENT_SCOPE)
  foreach(target IN LISTS ARGN)
    file(APPEND ${CMAKE_BINARY_DIR}/rooms.txt "${room} ${target}\n")
  endforeach()
endfunction()

# Tests are compiled quickly: their time goes into the rooms' code. Larger batches than the rooms':
# one room's tests are compiled at a time, and share nearly all of their headers' templates.
set(SHAKER_TEST_BATCH 12)
set(SHAKER_TEST_OPTIONS -O1 -g0)
set(SHAKER_TEST_TIMEOUT 300)
if(SHAKER_SANITIZE)
  set(SHAKER_TEST_OPTIONS -O1)
  set(SHAKER_TEST_TIMEOUT 600)
endif()

# shaker_test(NAME SOURCES a_test.cpp ... [APART b.cpp...] [DEPENDS targets...] [COST s])
# One GoogleTest executable; every test in it becomes a ctest test named NAME.Suite.Test. APART are
# sources that replace what the others use (operator new), so that they are compiled alone. A test with
# a COST, about its seconds, begins before those without one: at the end all cores have work.
function(shaker_test name)
  cmake_parse_arguments(arg "" "COST" "SOURCES;APART;DEPENDS" ${ARGN})
  shaker_room_of_tests(room test_${name})
  add_executable(test_${name} ${arg_SOURCES} ${arg_APART})
  shaker_batches(test_${name} AT_MOST ${SHAKER_TEST_BATCH} ${arg_SOURCES})
  target_link_libraries(test_${name} PRIVATE ${arg_DEPENDS} GTest::gmock_main)
  target_precompile_headers(test_${name} REUSE_FROM shaker_test_headers)
  target_compile_options(test_${name} PRIVATE ${SHAKER_TEST_OPTIONS})
  target_compile_definitions(test_${name} PRIVATE
    SHAKER_SOURCE_DIR="${CMAKE_SOURCE_DIR}" SHAKER_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT ${SHAKER_TEST_TIMEOUT} LABELS ${room} COST 0${arg_COST})
endfunction()

# shaker_script_test(NAME COMMAND word... [NEEDS targets...] [TIMEOUT s] [LABELS more...]
#                    [ENVIRONMENT name=value...] [PROPERTIES name value ...])
# A test that is a program or a script of its own; NEEDS are the targets that it runs.
function(shaker_script_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "COMMAND;NEEDS;LABELS;ENVIRONMENT;PROPERTIES" ${ARGN})
  shaker_room_of_tests(room ${arg_NEEDS})
  add_test(NAME ${name} COMMAND ${arg_COMMAND})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${room};${arg_LABELS}"
                                          ${arg_PROPERTIES})
  if(SHAKER_SANITIZE)  # tests/sanitized.py
    list(APPEND arg_ENVIRONMENT SHAKER_SANITIZED=1)
  endif()
  set_property(TEST ${name} PROPERTY ENVIRONMENT ${arg_ENVIRONMENT})
endfunction()
