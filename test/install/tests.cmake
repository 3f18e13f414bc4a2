# Installs the build into a scratch prefix, moves the prefix, and builds and runs consumer/ on it.
add_test(NAME install.consumer
  COMMAND ${CMAKE_COMMAND}
    -D BUILD_DIR=${PROJECT_BINARY_DIR}
    -D CONSUMER_DIR=${PROJECT_SOURCE_DIR}/test/install/consumer
    -D SCRATCH_DIR=${PROJECT_BINARY_DIR}/test-install
    -D GENERATOR=${CMAKE_GENERATOR}
    -D CXX_FLAGS=${CMAKE_CXX_FLAGS}
    -P ${PROJECT_SOURCE_DIR}/test/install/run.cmake)
bodyschema_patient(timeout 300)
set_tests_properties(install.consumer PROPERTIES LABELS install TIMEOUT ${timeout})

find_package(Python3 COMPONENTS Interpreter QUIET)
if(TARGET lcmtypes_python AND Python3_FOUND)
  # Skipped where PyPI's lcm cannot be installed or there is no route for multicast.
  foreach(example IN ITEMS listen publish masks)
    add_test(NAME install.python_example_${example}
      COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/install/python_example.py
        ${PROJECT_SOURCE_DIR}/docs/examples/${example}.py
        ${PROJECT_BINARY_DIR}/lcmtypes-python ${PROJECT_BINARY_DIR}/venv-lcm)
    bodyschema_patient(timeout 240)
    set_tests_properties(install.python_example_${example} PROPERTIES LABELS install TIMEOUT ${timeout}
      SKIP_RETURN_CODE 77 RESOURCE_LOCK venv-lcm)
  endforeach()

  # Skipped where PyPI's mcap, the official reader, cannot be installed.
  add_test(NAME install.mcap_reads_back
    COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/install/mcap_reads_back.py
      $<TARGET_FILE:bodyschema> ${PROJECT_BINARY_DIR}/lcmtypes-python
      ${PROJECT_BINARY_DIR}/venv-mcap ${PROJECT_BINARY_DIR}/test-mcap)
  bodyschema_patient(timeout 300)
  set_tests_properties(install.mcap_reads_back PROPERTIES LABELS install TIMEOUT ${timeout}
    SKIP_RETURN_CODE 77 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endif()

find_program(BODYSCHEMA_DPKG_DEB dpkg-deb)
find_program(BODYSCHEMA_DPKG_SHLIBDEPS dpkg-shlibdeps)
mark_as_advanced(BODYSCHEMA_DPKG_DEB BODYSCHEMA_DPKG_SHLIBDEPS)
if(BODYSCHEMA_DPKG_DEB AND BODYSCHEMA_DPKG_SHLIBDEPS AND BODYSCHEMA_PROGRAMS AND Python3_FOUND)
  add_test(NAME install.package
    COMMAND ${CMAKE_COMMAND}
      -D BUILD_DIR=${PROJECT_BINARY_DIR} -D SOURCE_DIR=${PROJECT_SOURCE_DIR}
      -D BUILD_TYPE=${CMAKE_BUILD_TYPE}
      -D SCRATCH_DIR=${PROJECT_BINARY_DIR}/test-package
      -D CPACK=${CMAKE_CPACK_COMMAND} -D DPKG_DEB=${BODYSCHEMA_DPKG_DEB}
      -D "PROGRAMS=${BODYSCHEMA_PROGRAMS}" -D JAVA_TYPES=$<TARGET_EXISTS:lcmtypes_jar>
      -P ${PROJECT_SOURCE_DIR}/test/install/package.cmake)
  bodyschema_patient(timeout 300)
  set_tests_properties(install.package PROPERTIES LABELS install TIMEOUT ${timeout})
endif()

find_program(BODYSCHEMA_SYSTEMD_ANALYZE systemd-analyze)
mark_as_advanced(BODYSCHEMA_SYSTEMD_ANALYZE)
if(BODYSCHEMA_SYSTEMD_ANALYZE)
  # The score of a hardened unit: 0 is a service that can do nothing, 10 one that may do anything.
  add_test(NAME install.unit_is_hardened
    COMMAND ${BODYSCHEMA_SYSTEMD_ANALYZE} security --offline=true --threshold=20 --no-pager
      ${PROJECT_SOURCE_DIR}/config/service/bodyschemad.service)
  bodyschema_patient(timeout 60)
  set_tests_properties(install.unit_is_hardened PROPERTIES LABELS install TIMEOUT ${timeout})
endif()

add_test(NAME docs.pages_agree_with_the_tree
  COMMAND ${CMAKE_COMMAND} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D "STOREYS=${BODYSCHEMA_STOREYS}"
    -P ${PROJECT_SOURCE_DIR}/test/install/docs.cmake)
bodyschema_patient(timeout 60)
set_tests_properties(docs.pages_agree_with_the_tree PROPERTIES LABELS docs TIMEOUT ${timeout})

if(Python3_FOUND AND BODYSCHEMA_PROGRAMS)
  # Every page with a block of commands.
  file(GLOB pages CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/*.md)
  foreach(file IN LISTS pages)
    file(STRINGS ${file} commands REGEX "^```sh$" LIMIT_COUNT 1)
    if(NOT commands)
      continue()
    endif()
    get_filename_component(page ${file} NAME_WE)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    add_test(NAME docs.${page}
      COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/docs/run_page.py
        ${file} ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_SOURCE_DIR}
        ${PROJECT_BINARY_DIR}/test-docs/${page})
    bodyschema_patient(timeout 900)
    set_tests_properties(docs.${page} PROPERTIES LABELS docs TIMEOUT ${timeout} SKIP_RETURN_CODE 77
      ENVIRONMENT BODYSCHEMA_TEST_PATIENCE=${BODYSCHEMA_TEST_PATIENCE})
    if(page MATCHES "^import_(ros_bag|lerobot)$")
      string(REPLACE "_" "-" environment ${CMAKE_MATCH_1})
      set_tests_properties(docs.${page} PROPERTIES RESOURCE_LOCK venv-${environment})
    endif()
  endforeach()
endif()

if(Python3_FOUND AND BODYSCHEMA_PROGRAMS)
  foreach(program IN LISTS BODYSCHEMA_PROGRAMS)
    list(APPEND help_programs $<TARGET_FILE:${program}>)
  endforeach()
  add_test(NAME install.help_has_examples
    COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/install/help.py
      ${PROJECT_SOURCE_DIR}/cmake/manual.py ${PROJECT_BINARY_DIR}/test-help ${help_programs})
  bodyschema_patient(timeout 120)
  set_tests_properties(install.help_has_examples PROPERTIES LABELS install TIMEOUT ${timeout}
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

  # Skipped where PyPI's xacro or Debian's python3-camera-calibration-parsers is not to be had.
  add_test(NAME pipeline.ros_files_read_back
    COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/pipeline/ros_files_read_back.py
      $<TARGET_FILE:bodyschema> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/venv-xacro
      ${PROJECT_BINARY_DIR}/test-ros-files)
  bodyschema_patient(timeout 300)
  set_tests_properties(pipeline.ros_files_read_back PROPERTIES LABELS integration TIMEOUT ${timeout}
    SKIP_RETURN_CODE 77 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)

  # Skipped where PyPI's rosbags, which writes the bags, cannot be installed.
  foreach(bag IN ITEMS bag real_bag)
    string(REGEX MATCH "^real" real ${bag})
    add_test(NAME imports.ros_${bag}
      COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/imports/ros_bag_import.py
        $<TARGET_FILE:bodyschema> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/venv-ros-bag
        ${PROJECT_BINARY_DIR}/test-ros-${bag} ${real})
    bodyschema_patient(timeout 600)
    set_tests_properties(imports.ros_${bag} PROPERTIES LABELS integration TIMEOUT ${timeout}
      SKIP_RETURN_CODE 77 RESOURCE_LOCK venv-ros-bag ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
  endforeach()

  # Skipped where PyPI's pyarrow and av, which write the data sets, cannot be installed.
  if(TARGET lcmtypes_python)
    foreach(set IN ITEMS set real_set)
      string(REGEX MATCH "^real" real ${set})
      add_test(NAME imports.lerobot_${set}
        COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/imports/lerobot_import.py
          $<TARGET_FILE:bodyschema> ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/venv-lerobot
          ${PROJECT_BINARY_DIR}/test-lerobot-${set} ${real})
      bodyschema_patient(timeout 600)
      set_tests_properties(imports.lerobot_${set} PROPERTIES LABELS integration TIMEOUT ${timeout}
        SKIP_RETURN_CODE 77 RESOURCE_LOCK venv-lerobot
        ENVIRONMENT "PYTHONDONTWRITEBYTECODE=1;BODYSCHEMA_LCM_TYPES=${PROJECT_BINARY_DIR}/lcmtypes-python")
    endforeach()
  endif()

  # Skipped where PyPI's mujoco is not installed: BODYSCHEMA_MUJOCO names its environment.
  if(TARGET lcmtypes_python)
    add_test(NAME foreign_simulator.check
      COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/foreign_simulator/foreign_simulator.py
        check icub_right ${PROJECT_BINARY_DIR}/test-foreign-simulator --program $<TARGET_FILE:bodyschema>)
    bodyschema_patient(timeout 120)
    set_tests_properties(foreign_simulator.check PROPERTIES LABELS integration TIMEOUT ${timeout}
      SKIP_RETURN_CODE 77 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
  endif()

  # Skipped where snakemake is not installed.
  add_test(NAME fleet.workflow
    COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/fleet/workflow.py
      ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/test-fleet)
  bodyschema_patient(timeout 600)
  set_tests_properties(fleet.workflow PROPERTIES LABELS integration TIMEOUT ${timeout} SKIP_RETURN_CODE 77
    ENVIRONMENT BODYSCHEMA_TEST_PATIENCE=${BODYSCHEMA_TEST_PATIENCE})
  # Without a cluster; skipped where neither an old Snakemake nor PyPI's, with its plugin for clusters, is to be had.
  add_test(NAME fleet.workflow_on_a_cluster
    COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/fleet/cluster_workflow.py
      ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/test-fleet-cluster
      ${PROJECT_BINARY_DIR}/venv-snakemake)
  bodyschema_patient(timeout 600)
  set_tests_properties(fleet.workflow_on_a_cluster PROPERTIES LABELS integration TIMEOUT ${timeout} SKIP_RETURN_CODE 77
    ENVIRONMENT "PYTHONDONTWRITEBYTECODE=1;BODYSCHEMA_TEST_PATIENCE=${BODYSCHEMA_TEST_PATIENCE}")
endif()

find_program(BODYSCHEMA_JAVA java)
mark_as_advanced(BODYSCHEMA_JAVA)
if(TARGET lcmtypes_jar AND BODYSCHEMA_JAVA)
  add_test(NAME install.lcm_spy_knows_our_types
    COMMAND ${BODYSCHEMA_JAVA}
      -cp ${BODYSCHEMA_LCM_JAR}:${PROJECT_BINARY_DIR}/bodyschema-lcmtypes.jar
      ${PROJECT_SOURCE_DIR}/test/install/LcmSpyTypes.java)
  list(LENGTH lcm_files type_count)
  bodyschema_patient(timeout 120)
  set_tests_properties(install.lcm_spy_knows_our_types PROPERTIES LABELS install TIMEOUT ${timeout}
    PASS_REGULAR_EXPRESSION "Found ${type_count} LCM types\n")
endif()

if(CMAKE_GENERATOR STREQUAL "Ninja" AND BODYSCHEMA_PROGRAMS)
  add_test(NAME install.demo_builds_the_programs_alone
    COMMAND ${CMAKE_COMMAND} -D BUILD_DIR=${PROJECT_BINARY_DIR} -D SOURCE_DIR=${PROJECT_SOURCE_DIR}
      -D NINJA=${CMAKE_MAKE_PROGRAM} -D "PROGRAMS=${BODYSCHEMA_PROGRAMS}"
      -P ${PROJECT_SOURCE_DIR}/test/install/demo.cmake)
  bodyschema_patient(timeout 60)
  set_tests_properties(install.demo_builds_the_programs_alone PROPERTIES LABELS install TIMEOUT ${timeout})
endif()

if(Python3_FOUND)
  # Skipped where neither Docker nor Podman works.
  add_test(NAME install.container
    COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/test/install/container.py ${PROJECT_SOURCE_DIR})
  bodyschema_patient(timeout 3600)
  set_tests_properties(install.container PROPERTIES LABELS install TIMEOUT ${timeout} SKIP_RETURN_CODE 77)
endif()
