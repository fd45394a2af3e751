# Language level, warnings, sanitizers, third-party packages and ap_types, for every target of the project.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# Assertions of the kernels and of the golden model stay on in every build.
string(REPLACE "-DNDEBUG" "" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
string(REPLACE "-DNDEBUG" "" CMAKE_CXX_FLAGS_RELWITHDEBINFO "${CMAKE_CXX_FLAGS_RELWITHDEBINFO}")

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

add_library(retrace_options INTERFACE)
target_include_directories(retrace_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(retrace_options INTERFACE -Wall -Wextra -Wno-unknown-pragmas -Wno-unused-label -ffp-contract=off)
if(RETRACE_SANITIZE)
  target_compile_options(retrace_options INTERFACE -fsanitize=${RETRACE_SANITIZE} -fno-sanitize-recover=all
                                                   -fno-omit-frame-pointer)
  target_link_options(retrace_options INTERFACE -fsanitize=${RETRACE_SANITIZE})
endif()

if(RETRACE_FUZZ)
  target_compile_options(retrace_options INTERFACE -fsanitize=fuzzer-no-link)  # coverage of the libraries guides the fuzzer
endif()

find_package(TBB REQUIRED)
find_package(OpenImageIO REQUIRED)
# Debian's package of OpenImageIO names folders of optional packages (OpenCV) that need not be there; CMake refuses such a target.
get_target_property(_oiio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
foreach(_dir ${_oiio_includes})
  if(NOT EXISTS ${_dir})
    list(REMOVE_ITEM _oiio_includes ${_dir})
  endif()
endforeach()
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${_oiio_includes}")
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(glm REQUIRED)
find_package(embree 3 QUIET)  # oracle of the tests and yardstick of `retrace bench`; never needed to run the program

# The Python module, where the Python that tests run with has nanobind (scripts/setup.sh --tools).
if(RETRACE_PYTHON)
  if(NOT SKBUILD AND NOT Python_EXECUTABLE AND EXISTS ${CMAKE_SOURCE_DIR}/.env/py/bin/python)
    set(Python_EXECUTABLE ${CMAKE_SOURCE_DIR}/.env/py/bin/python)
  endif()
  find_package(Python 3.11 QUIET COMPONENTS Interpreter Development.Module)
  execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir OUTPUT_VARIABLE nanobind_ROOT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(Python_FOUND)
    find_package(nanobind CONFIG QUIET)
  endif()
  if(RETRACE_SANITIZE OR NOT nanobind_FOUND)
    if(SKBUILD)
      message(FATAL_ERROR "The Python module needs nanobind and the headers of Python (Debian: python3-dev)")
    endif()
    message(STATUS "No Python module: it needs nanobind, the headers of Python (scripts/setup.sh --tools) and a build without sanitizers")
    set(RETRACE_PYTHON OFF)
  endif()
endif()
# With the RTL the models have to be compiled for a shared library; the program's are not.
if(RETRACE_PYTHON AND SKBUILD)
  set(RETRACE_PYTHON_RTL ${RETRACE_RTL})
endif()

set(_ap_candidates ${RETRACE_AP_TYPES})
if(NOT RETRACE_AP_TYPES)
  foreach(_root $ENV{XILINX_HLS} $ENV{XILINX_VITIS})
    list(APPEND _ap_candidates ${_root}/include)
  endforeach()
  list(APPEND _ap_candidates ${CMAKE_SOURCE_DIR}/.env/ap_types)
endif()
find_path(RETRACE_AP_INCLUDE ap_int.h PATHS ${_ap_candidates} NO_DEFAULT_PATH)
if(NOT RETRACE_AP_INCLUDE)
  message(FATAL_ERROR "ap_int.h not found in: ${_ap_candidates}. Run scripts/setup.sh, or name a folder with -DRETRACE_AP_TYPES=")
endif()
# The vendor's integers, of any width.
add_library(retrace_vendor_integers INTERFACE)
target_include_directories(retrace_vendor_integers SYSTEM INTERFACE ${RETRACE_AP_INCLUDE})
# The open ap_types alias their storage and read the bits they are about to replace.
target_compile_options(retrace_vendor_integers INTERFACE -fno-strict-aliasing -Wno-uninitialized $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
if(RETRACE_SANITIZE MATCHES "undefined")
  # The open ap_types shift negative values to the left, which C++20 defines and C++17, the kernels' language, does not.
  target_compile_options(retrace_vendor_integers INTERFACE -fno-sanitize=shift-base)
endif()
# Those of the kernels in C simulation are testbench/csim/include/ap_int.h, which ap_int_values holds against the vendor's.
add_library(retrace_ap_types INTERFACE)
if(RETRACE_VENDOR_INTEGERS)
  target_link_libraries(retrace_ap_types INTERFACE retrace_vendor_integers)
else()
  target_include_directories(retrace_ap_types SYSTEM INTERFACE ${CMAKE_SOURCE_DIR}/testbench/csim/include)
  # Words of memory are read as the kernels' integers.
  target_compile_options(retrace_ap_types INTERFACE -fno-strict-aliasing)
endif()

# retrace_optimise_little(<target>): for sources that compile longer than they run.
function(retrace_optimise_little target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# retrace_add_test(<name> <libraries...>): builds <name>.cpp with GoogleTest; every test in it is a test of ctest, <name>.<suite>.<test>.
# Every test reads RETRACE_SEED; scenes and models are found through the two definitions.
include(GoogleTest)
set(RETRACE_MODELS_DIR /usr/share/assimp/models CACHE PATH "Debian's assimp-testmodels; tests that need a missing model are skipped")
function(retrace_add_test name)
  find_package(GTest REQUIRED)
  add_executable(${name} ${name}.cpp)
  retrace_optimise_little(${name})
  target_link_libraries(${name} PRIVATE ${ARGN} GTest::gtest_main retrace_options)
  target_compile_definitions(${name} PRIVATE RETRACE_MODELS_DIR="${RETRACE_MODELS_DIR}" RETRACE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  # At the end of the folder, when labels and costs are known.
  cmake_language(EVAL CODE "cmake_language(DEFER CALL retrace_discover_tests ${name})")
endfunction()
function(retrace_discover_tests name)
  get_target_property(properties ${name} RETRACE_TEST_PROPERTIES)
  if(NOT properties)
    set(properties)
  endif()
  gtest_discover_tests(${name} TEST_PREFIX ${name}. PROPERTIES ${properties} DISCOVERY_TIMEOUT 120)
endfunction()

# Tests that read hostile input or exercise the kernels also run under sanitizers: retrace_sanitize(<test>...) labels them and makes them
# part of the target `sanitized`.
add_custom_target(sanitized)
function(retrace_sanitize)
  foreach(name ${ARGN})
    add_dependencies(sanitized ${name})
    set_property(TARGET ${name} APPEND PROPERTY RETRACE_TEST_PROPERTIES LABELS sanitized)
  endforeach()
endfunction()

# retrace_costs(<seconds> <test>...): what takes long starts first, so that no core waits at the end for the one test that is left. Tests of the
# folder that are not there are passed over.
function(retrace_costs seconds)
  foreach(name ${ARGN})
    if(TEST ${name})
      set_property(TEST ${name} PROPERTY COST ${seconds})
    elseif(TARGET ${name})
      set_property(TARGET ${name} APPEND PROPERTY RETRACE_TEST_PROPERTIES COST ${seconds})
    endif()
  endforeach()
endfunction()

# The registry of engines (golden/engine/registry.hpp). retrace_register_engine(<library> <function>): the engine whose EngineKind the function
# `retrace::<function>()` of the library returns. retrace_absent_engine(<name> <remedy>): what a program says of an engine that is left out.
# retrace_engine_list(<target> [<name> <remedy>]...): links all engines registered so far and gives the target `register_engines()`; further names are of
# engines that only this target leaves out.
function(retrace_register_engine library function)
  set_property(GLOBAL APPEND PROPERTY RETRACE_ENGINES ${library} ${function})
endfunction()
function(retrace_absent_engine name remedy)
  set_property(GLOBAL APPEND PROPERTY RETRACE_ABSENT_ENGINES ${name} "${remedy}")
endfunction()
function(retrace_engine_list target)
  get_property(engines GLOBAL PROPERTY RETRACE_ENGINES)
  get_property(absent GLOBAL PROPERTY RETRACE_ABSENT_ENGINES)
  list(APPEND absent ${ARGN})
  set(declarations)
  set(calls)
  while(engines)
    list(POP_FRONT engines library function)
    target_link_libraries(${target} PRIVATE ${library})
    string(APPEND declarations "EngineKind ${function}();\n")
    string(APPEND calls "  register_engine(${function}());\n")
  endwhile()
  while(absent)
    list(POP_FRONT absent name remedy)
    string(APPEND calls "  register_absent_engine(\"${name}\", \"${remedy}\");\n")
  endwhile()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${target}_engines.cpp CONTENT [[
// Generated by retrace_engine_list().
#include "golden/engine/registry.hpp"

namespace retrace {

@declarations@
void register_engines() {
  static bool done = false;
  if (done) return;
  done = true;
@calls@}

}  // namespace retrace
]] @ONLY)
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/${target}_engines.cpp)
endfunction()
