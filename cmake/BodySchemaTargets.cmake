# bodyschema_library(<folder> SOURCES ... [LINKS folder...] [HEADERS folder...] [PUBLIC lib...] [PRIVATE lib...])
#   One library per folder of src/, named bodyschema_<folder>, alias bodyschema::<folder>.
#   LINKS names other folders, HEADERS those of which headers alone are used; a storey that is not
#   below, and an #include from one that is not named, are configure errors, so the dependency rule
#   of docs/architecture.md cannot be broken by accident. Without SOURCES the library is header-only.
function(bodyschema_library folder)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  set(target bodyschema_${folder})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    bodyschema_warnings(${target})
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(bodyschema::${folder} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${folder})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  list(FIND BODYSCHEMA_STOREYS ${folder} own_index)
  bodyschema_check_includes(${folder} ${folder} ${ARG_LINKS} ${ARG_HEADERS})
  foreach(other IN LISTS ARG_LINKS ARG_HEADERS)
    list(FIND BODYSCHEMA_STOREYS ${other} other_index)
    # Headers do not need their storey to be built (BODYSCHEMA_SILHOUETTE_ONLY).
    if(other_index GREATER_EQUAL own_index OR (other_index LESS 0 AND other IN_LIST ARG_LINKS))
      message(FATAL_ERROR "src/${folder} may not link ${other}: it is not a storey below (BODYSCHEMA_STOREYS)")
    endif()
  endforeach()
  list(TRANSFORM ARG_LINKS PREPEND bodyschema::)
  target_link_libraries(${target} ${scope} ${ARG_LINKS})
  target_link_libraries(${target} ${scope} ${ARG_PUBLIC})
  set_property(GLOBAL APPEND PROPERTY BODYSCHEMA_LIBRARIES ${target})
endfunction()

# bodyschema_check_includes(<folder> <allowed folder>...)
#   Every folder's headers lie in one include/: without this a library could use one it does not name.
function(bodyschema_check_includes folder)
  file(GLOB files ${PROJECT_SOURCE_DIR}/src/${folder}/*.[ch]pp ${PROJECT_SOURCE_DIR}/include/bodyschema/${folder}/*.hpp)
  foreach(file IN LISTS files)
    file(STRINGS ${file} lines REGEX "^#include \"bodyschema/[a-z0-9_]+/")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^#include \"bodyschema/([a-z0-9_]+)/.*" "\\1" other "${line}")
      if(NOT other IN_LIST ARGN)
        message(FATAL_ERROR "${file} includes from ${other}, which src/${folder}/CMakeLists.txt does not name")
      endif()
    endforeach()
  endforeach()
endfunction()

function(bodyschema_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                         $<$<BOOL:${BODYSCHEMA_WERROR}>:-Werror>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC 12 reports std::string's operator+ as overlapping (GCC bug 105651).
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  get_target_property(together ${target} UNITY_BUILD)
  if(together)
    # What a source keeps to itself lies in an included file then, which GCC takes for a header.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# bodyschema_patient(<variable> <seconds>)
#   The time a test may take: of a release build, times BODYSCHEMA_TEST_PATIENCE (sanitizers are slow).
function(bodyschema_patient variable seconds)
  math(EXPR limit "${seconds} * ${BODYSCHEMA_TEST_PATIENCE}")
  set(${variable} ${limit} PARENT_SCOPE)
endfunction()

# bodyschema_test(<folder> SOURCES ... [LINKS lib...] [LABELS ...] [TIMEOUT seconds] [LAST] [LONG] [LONG_TESTS ...] [FRESH])
#   One GoogleTest program per folder of test/, named test_<folder>. LAST: its tests mostly wait, by a clock, for programs
#   that need a processor at once; they begin when all others have begun, so that they run beside each other, and each
#   alone where sanitizers make the programs slow.
#   LONG: logs of many pictures, label long; outside the default suite, ctest -C long -L long runs them. LONG_TESTS: only
#   these of the program, as suite.test.
#   FRESH: draws from BODYSCHEMA_SEED (test/random_seed.hpp), which is fixed in the default suite; ctest -C fresh -L fresh
#   runs it with a seed that nobody has seen, and prints that.
function(bodyschema_test folder)
  cmake_parse_arguments(ARG "LAST;LONG;FRESH" "TIMEOUT" "SOURCES;LINKS;LABELS;LONG_TESTS" ${ARGN})
  find_package(GTest REQUIRED)
  set(target test_${folder})
  add_executable(${target} ${ARG_SOURCES})
  set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)  # tests' own helpers are named alike
  bodyschema_warnings(${target})
  target_link_libraries(${target} PRIVATE ${ARG_LINKS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/test)
  target_compile_definitions(${target} PRIVATE
    BODYSCHEMA_SOURCE_DIR="${PROJECT_SOURCE_DIR}" BODYSCHEMA_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  bodyschema_patient(timeout ${ARG_TIMEOUT})
  set(patience BODYSCHEMA_TEST_PATIENCE=${BODYSCHEMA_TEST_PATIENCE})
  set(order)
  if(ARG_LAST)
    set(order COST -1)  # ctest begins with the dearest; those it has not timed yet cost nothing
    if(BODYSCHEMA_TEST_PATIENCE GREATER 1)
      list(APPEND order RUN_SERIAL TRUE)
    endif()
  endif()
  if(ARG_LONG)
    bodyschema_tests_of(long_tests ${ARG_SOURCES})
    bodyschema_long_tests(${target} ${long_tests})
  else()
    include(GoogleTest)
    bodyschema_long_tests(${target} ${ARG_LONG_TESTS})
    set(filter)
    if(ARG_LONG_TESTS)
      list(JOIN ARG_LONG_TESTS ":" left_out)
      set(filter TEST_FILTER "-${left_out}")
    endif()
    gtest_discover_tests(${target} DISCOVERY_TIMEOUT 60 ${filter}
      PROPERTIES TIMEOUT ${timeout} LABELS "${ARG_LABELS}" ${order} ENVIRONMENT ${patience})
  endif()
  if(ARG_FRESH)
    add_test(NAME fresh.${folder} CONFIGURATIONS fresh COMMAND ${target})
    set_tests_properties(fresh.${folder} PROPERTIES TIMEOUT ${timeout} LABELS fresh
      ENVIRONMENT "${patience};BODYSCHEMA_SEED=fresh")
  endif()
endfunction()

# The names of each TEST or TEST_F of some sources (gtest_discover_tests knows no configurations).
macro(bodyschema_tests_of names)
  set(${names})
  foreach(source ${ARGN})
    file(STRINGS ${source} lines REGEX "^TEST(_F)?\\(")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^TEST(_F)?\\(([A-Za-z0-9]+), *([A-Za-z0-9]+)\\).*" "\\2.\\3" name "${line}")
      list(APPEND ${names} ${name})
    endforeach()
  endforeach()
endmacro()

# One ctest for each of these tests, of the configuration long.
macro(bodyschema_long_tests program)
  foreach(name ${ARGN})
    add_test(NAME long.${name} CONFIGURATIONS long COMMAND ${program} --gtest_filter=${name})
    set_tests_properties(long.${name} PROPERTIES TIMEOUT ${timeout} LABELS "long;${ARG_LABELS}"
      ENVIRONMENT ${patience})
  endforeach()
endmacro()
