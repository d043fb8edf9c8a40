# Compiles the most common headers once for the libraries and programs, and once for the tests. Without this, half
# the time of a full build goes into parsing them.
option(SQSLAM_PRECOMPILE_HEADERS "Compile common headers once" ON)

# Compiles the sources of a folder in groups, which parses their common headers and templates only once. Names in
# anonymous namespaces must therefore differ between the files of a library or program (scripts/check-modules.py).
# Turn it off while you edit a few files.
option(SQSLAM_UNITY_BUILD "Compile the sources of a library or program in groups" ON)
set(SQSLAM_UNITY_BATCH_SIZE 10 CACHE STRING "Sources in a group; 0: all of a library or program")

function(sqslam_group_sources target)
  get_target_property(sources ${target} SOURCES)
  list(LENGTH sources count)
  if(SQSLAM_UNITY_BUILD AND count GREATER 1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${SQSLAM_UNITY_BATCH_SIZE})
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)  # which treats the sources of a group as headers
      target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
    endif()
  endif()
endfunction()

# sqslam_precompiled(<name> HEADER LIBRARIES...): compiles a header of this folder once, for REUSE_FROM.
function(sqslam_precompiled name header)
  if(SQSLAM_PRECOMPILE_HEADERS)
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cpp CONTENT "")
    add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PRIVATE ${ARGN})
    target_precompile_headers(${name} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/${header})
  endif()
endfunction()

function(sqslam_reuse_precompiled target name)
  if(SQSLAM_PRECOMPILE_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${name})
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      target_compile_options(${target} PRIVATE -fpch-preprocess)  # lets ccache see the compiled header
    endif()
  endif()
endfunction()

# sqslam_export(<name> TARGET): installs the target for other projects as sqslam::<name>.
function(sqslam_export name target)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT sqslamTargets COMPONENT libsqslam-dev
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} OBJECTS DESTINATION ${CMAKE_INSTALL_LIBDIR}/sqslam
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sqslam)
endfunction()

# sqslam_library(<name> SOURCES ... DEPENDS ...): one static library per folder, target sqslam_<name>. Libraries of
# slam/ and render/ are installed for other projects.
function(sqslam_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(sqslam_${name} STATIC ${ARG_SOURCES})
  target_include_directories(sqslam_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  target_compile_features(sqslam_${name} PUBLIC cxx_std_20)
  target_link_libraries(sqslam_${name} PUBLIC ${ARG_DEPENDS})
  target_compile_options(sqslam_${name} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor)
  sqslam_group_sources(sqslam_${name})
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE folder)
  if(folder MATCHES "^(slam|render)")
    sqslam_export(${name} sqslam_${name})
    set_property(GLOBAL APPEND PROPERTY SQSLAM_LIBRARIES sqslam_${name})
    sqslam_reuse_precompiled(sqslam_${name} sqslam_common_headers)
  else()
    sqslam_compile_quickly(sqslam_${name})
  endif()
endfunction()

# Code that parses, prints and tests runs only briefly, and -O1 compiles it in a quarter less time than -O3. What it
# calls in slam/ and render/ keeps its optimisation level.
set(SQSLAM_QUICK_OPTIONS $<$<CONFIG:Release>:-O1>)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)  # which at -O1 takes variants for uninitialised
  list(APPEND SQSLAM_QUICK_OPTIONS -Wno-maybe-uninitialized)
endif()
set(SQSLAM_TEST_OPTIONS ${SQSLAM_QUICK_OPTIONS})

# sqslam_compile_quickly(<target>): for programs and libraries outside of slam/ and render/.
function(sqslam_compile_quickly target)
  target_compile_options(${target} PRIVATE ${SQSLAM_QUICK_OPTIONS})
  sqslam_reuse_precompiled(${target} sqslam_program_headers)
endfunction()

# UBSan's checks of the tests' own code, in which it is not to find anything, take two fifths of its compilation.
option(SQSLAM_SANITIZE_TESTS "Have UBSan check the tests' own code too" ON)
if(NOT SQSLAM_SANITIZE_TESTS)
  list(APPEND SQSLAM_TEST_OPTIONS -fno-sanitize=undefined)
endif()

# sqslam_test(<name> SOURCES ... DEPENDS ... [COST number]): one GoogleTest program; registers each of its suites with
# ctest (DiscoverSuites.cmake). Suites of a higher cost are started first, so that no long one is left for the end.
function(sqslam_test name)
  cmake_parse_arguments(ARG "" "COST" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name}_test ${ARG_SOURCES})
  target_link_libraries(${name}_test PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name}_test PRIVATE SQSLAM_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_compile_options(${name}_test PRIVATE ${SQSLAM_TEST_OPTIONS})
  sqslam_group_sources(${name}_test)
  sqslam_reuse_precompiled(${name}_test sqslam_common_test_headers)
  if(NOT ARG_COST)
    set(ARG_COST 0)
  endif()
  set(include ${CMAKE_CURRENT_BINARY_DIR}/${name}_test.cmake)
  file(CONFIGURE OUTPUT ${include} @ONLY CONTENT [[
set(program "@CMAKE_RUNTIME_OUTPUT_DIRECTORY@/@name@_test")
set(name @name@)
set(folder "@CMAKE_CURRENT_BINARY_DIR@")
set(properties LABELS @name@ COST @ARG_COST@ WORKING_DIRECTORY "@CMAKE_CURRENT_BINARY_DIR@")
include("@PROJECT_SOURCE_DIR@/cmake/DiscoverSuites.cmake")
]])
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include})
endfunction()
