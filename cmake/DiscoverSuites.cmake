# Read by ctest, which knows `program`, `name`, `folder` and `properties` from the file that sqslam_test has written:
# registers each suite of a GoogleTest program as one test. A test of its own for every case would start the program,
# with all its libraries, more than a thousand times; that took longer than most of the cases. A failed suite shows the
# program's output, which names the case.
if(NOT EXISTS "${program}")
  add_test(${name}.NOT_BUILT "${program}")
  return()
endif()
# What the program prints last where it has skipped a case and none has failed.
set(skipped "\\[  SKIPPED \\] [^\n]*\n$")
set(list "${folder}/${name}_suites.cmake")
if(NOT EXISTS "${list}" OR NOT "${list}" IS_NEWER_THAN "${program}" OR
   NOT "${list}" IS_NEWER_THAN "${CMAKE_CURRENT_LIST_FILE}")
  execute_process(COMMAND "${program}" --gtest_list_tests OUTPUT_VARIABLE cases RESULT_VARIABLE result TIMEOUT 60)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${program} --gtest_list_tests: ${result}\n${cases}")
  endif()
  string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." lines "${cases}")  # "Suite." or "Prefix/Suite/0.  # TypeParam = ..."
  if(NOT lines)
    message(FATAL_ERROR "${program} lists no tests:\n${cases}")
  endif()
  set(script "")
  foreach(line ${lines})
    string(REGEX REPLACE "[\n.]" "" suite "${line}")
    string(APPEND script "add_test(${name}.${suite} \"${program}\" --gtest_filter=${suite}.*)\n"
      "set_tests_properties(${name}.${suite} PROPERTIES SKIP_REGULAR_EXPRESSION \"\${skipped}\" \${properties})\n")
  endforeach()
  file(WRITE "${list}" "${script}")
endif()
include("${list}")
