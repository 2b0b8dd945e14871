# Compiler settings and the two functions with which every room declares itself.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")

option(SHAKER_WERROR "Warnings are errors" ON)
set(SHAKER_SANITIZE "" CACHE STRING "Sanitizers: 'address,undefined' or 'thread'")

add_compile_options(-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
                    -Wold-style-cast -Wdouble-promotion -Wformat=2 -Wcast-align)
if(SHAKER_WERROR)
  add_compile_options(-Werror)
endif()
# A program is bound to the shared libraries that it really uses, not to all that its rooms know.
add_link_options(-Wl,--as-needed)
if(SHAKER_SANITIZE)
  # -O1: a third less time to build, and traces that can be read.
  add_compile_options(-O1 -fsanitize=${SHAKER_SANITIZE} -fno-omit-frame-pointer
                      -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${SHAKER_SANITIZE})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    add_compile_options(-fsanitize-ignorelist=${CMAKE_SOURCE_DIR}/cmake/not-ours.txt)
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

# What nearly every file of the estimator includes, read once, where clang builds: g++ 12 warns
# wrongly of what comes from a precompiled header, and so shows that each file includes what it
# uses. Of no use to files that are compiled with options of their own.
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  file(GENERATE OUTPUT headers.cpp CONTENT "// Only for its precompiled headers.\n")
  add_library(shaker_headers OBJECT ${CMAKE_CURRENT_BINARY_DIR}/headers.cpp)
  target_link_libraries(shaker_headers PRIVATE Threads::Threads fmt::fmt Eigen3::Eigen)
  target_precompile_headers(shaker_headers PRIVATE
    <algorithm> <cmath> <functional> <limits> <memory> <numbers> <optional> <span> <stdexcept>
    <string> <vector> <Eigen/Dense> <fmt/format.h>)
endif()
function(shaker_precompiled name)
  if(TARGET shaker_headers)
    target_precompile_headers(shaker_${name} REUSE_FROM shaker_headers)
  endif()
endfunction()

# shaker_library(NAME SOURCES a.cpp b.cpp [DEPENDS targets...])
# A room's static library, target shaker_NAME, included from the project's root.
function(shaker_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(shaker_${name} STATIC ${arg_SOURCES})
  target_include_directories(shaker_${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>
                                                   $<INSTALL_INTERFACE:include/shaker>)
  target_link_libraries(shaker_${name} PUBLIC ${arg_DEPENDS})
endfunction()

# shaker_test(NAME SOURCES a_test.cpp ... [DEPENDS targets...])
# One GoogleTest executable; every test in it becomes a ctest test named NAME.Suite.Test.
function(shaker_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(test_${name} ${arg_SOURCES})
  target_link_libraries(test_${name} PRIVATE ${arg_DEPENDS} GTest::gmock_main)
  target_precompile_headers(test_${name} REUSE_FROM shaker_test_headers)
  target_compile_definitions(test_${name} PRIVATE
    SHAKER_SOURCE_DIR="${CMAKE_SOURCE_DIR}" SHAKER_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
  gtest_discover_tests(test_${name} TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT 300)
endfunction()
