# Run by ctest (see tests.cmake): makes the Debian package and looks into it.
file(REMOVE_RECURSE ${SCRATCH_DIR})
file(MAKE_DIRECTORY ${SCRATCH_DIR})
execute_process(COMMAND ${CPACK} -G DEB -B ${SCRATCH_DIR} --config ${BUILD_DIR}/CPackConfig.cmake
                WORKING_DIRECTORY ${SCRATCH_DIR}
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "cpack failed:\n${output}")
endif()
file(GLOB package ${SCRATCH_DIR}/bodyschema_*.deb)
execute_process(COMMAND ${DPKG_DEB} -x ${package} ${SCRATCH_DIR}/content COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${DPKG_DEB} -e ${package} ${SCRATCH_DIR}/control COMMAND_ERROR_IS_FATAL ANY)

foreach(path IN ITEMS
    etc/bodyschema/estimator.yaml etc/default/bodyschemad
    usr/lib/systemd/system/bodyschemad.service usr/lib/sysctl.d/60-bodyschema.conf
    usr/share/bodyschema/config/icub_right/estimator.yaml
    usr/share/bodyschema/meshes/icub_right/icub_right.urdf
    usr/share/bodyschema/lcmtypes/bodyschema_joint_offsets_t.lcm
    usr/share/bodyschema/python/bodyschema/joint_offsets_t.py
    usr/share/bodyschema/import/framing.py usr/share/bodyschema/import/read_ros_bag.py
    usr/share/bodyschema/import/ros-bag.txt usr/share/bodyschema/import/read_lerobot.py
    usr/share/bodyschema/import/lerobot.txt usr/share/bodyschema/config/g1/lerobot.yaml
    usr/lib/cmake/bodyschema/bodyschemaConfig.cmake
    usr/include/bodyschema/robot/robot_model.hpp
    usr/share/doc/bodyschema/README.md usr/share/doc/bodyschema/SECURITY.md
    usr/share/doc/bodyschema/bench/README.md
    usr/share/doc/bodyschema/docs/README.md usr/share/doc/bodyschema/docs/launch_at_boot.md)
  if(NOT EXISTS ${SCRATCH_DIR}/content/${path})
    message(SEND_ERROR "the package lacks ${path}")
  endif()
endforeach()
if(JAVA_TYPES AND NOT EXISTS ${SCRATCH_DIR}/content/usr/share/java/bodyschema-lcmtypes.jar)
  message(SEND_ERROR "the package lacks the types for lcm-spy, which were built")
endif()
foreach(program IN LISTS PROGRAMS)
  foreach(path IN ITEMS usr/bin/${program} usr/share/man/man1/${program}.1
                        usr/share/bash-completion/completions/${program})
    if(NOT EXISTS ${SCRATCH_DIR}/content/${path})
      message(SEND_ERROR "the package lacks ${path}")
    endif()
  endforeach()
endforeach()

# Where it was built must not matter to it (debug information names the sources, so release only).
if(BUILD_TYPE STREQUAL "Release")
  file(GLOB_RECURSE files ${SCRATCH_DIR}/content/*)
  foreach(file IN LISTS files)
    file(STRINGS ${file} leaks REGEX "${SOURCE_DIR}/" LIMIT_COUNT 1)
    if(leaks)
      message(SEND_ERROR "${file} holds a path of the machine that built it: ${leaks}")
    endif()
  endforeach()
endif()

# Every link of an installed page leads somewhere.
file(GLOB_RECURSE pages ${SCRATCH_DIR}/content/usr/share/doc/bodyschema/*.md)
include(${CMAKE_CURRENT_LIST_DIR}/links.cmake)
check_links(${pages})

# The libraries that the programs link are dependencies; found by dpkg-shlibdeps.
file(STRINGS ${SCRATCH_DIR}/control/control depends REGEX "^Depends:")
if(NOT depends MATCHES "libyaml-cpp" OR NOT depends MATCHES "libc6")
  message(SEND_ERROR "the package does not depend on what its programs link: ${depends}")
endif()

# The two files in /etc survive upgrades.
file(STRINGS ${SCRATCH_DIR}/control/conffiles conffiles)
if(NOT conffiles STREQUAL "/etc/bodyschema/estimator.yaml;/etc/default/bodyschemad")
  message(SEND_ERROR "conffiles: ${conffiles}")
endif()

# The package alone is enough: what it unpacked to checks itself, with nothing but its own files.
execute_process(COMMAND ${CMAKE_COMMAND} -E env --unset=BODYSCHEMA_SHARE --unset=BODYSCHEMA_DATA
                        ${SCRATCH_DIR}/content/usr/bin/bodyschema selftest
                WORKING_DIRECTORY / RESULT_VARIABLE result OUTPUT_VARIABLE output)
message("${output}")
if(NOT output MATCHES "OK +files +[^\n]* ${SCRATCH_DIR}/content/usr/share/bodyschema\n")
  message(SEND_ERROR "the unpacked program does not read its own files")
endif()
if(NOT output MATCHES "(OK|WARN) +reach " OR output MATCHES "FAIL +(version|files|robot|opengl|engine)")
  message(SEND_ERROR "the unpacked package does not pass its self-test")
endif()
if(output MATCHES "FAIL" AND result EQUAL 0)
  message(SEND_ERROR "a failed check must show in the exit status")
endif()
