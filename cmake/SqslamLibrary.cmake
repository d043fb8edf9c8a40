# sqslam_library(<name> SOURCES ... DEPENDS ...): one small static library per folder, target sqslam_<name>.
function(sqslam_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(sqslam_${name} STATIC ${ARG_SOURCES})
  target_include_directories(sqslam_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(sqslam_${name} PUBLIC ${ARG_DEPENDS})
  target_compile_options(sqslam_${name} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor)
endfunction()

# sqslam_test(<name> SOURCES ... DEPENDS ...): one GoogleTest program, each of its tests known to ctest.
function(sqslam_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name}_test ${ARG_SOURCES})
  target_link_libraries(${name}_test PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name}_test PRIVATE SQSLAM_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  include(GoogleTest)
  gtest_discover_tests(${name}_test DISCOVERY_MODE PRE_TEST PROPERTIES LABELS ${name})
endfunction()
