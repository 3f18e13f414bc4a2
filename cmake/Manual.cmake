# Man pages and bash completion of all programs, made from their --help after they are built.
find_package(Python3 COMPONENTS Interpreter QUIET)
if(NOT BODYSCHEMA_PROGRAMS OR NOT Python3_FOUND OR CMAKE_CROSSCOMPILING)
  return()
endif()
set(manual_dir ${PROJECT_BINARY_DIR}/manual)
set(program_files "")
foreach(program IN LISTS BODYSCHEMA_PROGRAMS)
  list(APPEND program_files $<TARGET_FILE:${program}>)
endforeach()
add_custom_command(OUTPUT ${manual_dir}/stamp
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual_dir}
  COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/cmake/manual.py ${manual_dir} ${PROJECT_VERSION}
          ${program_files}
  COMMAND ${CMAKE_COMMAND} -E touch ${manual_dir}/stamp
  DEPENDS ${BODYSCHEMA_PROGRAMS} ${PROJECT_SOURCE_DIR}/cmake/manual.py
  COMMENT "Man pages and shell completion" VERBATIM)
add_custom_target(manual ALL DEPENDS ${manual_dir}/stamp)
install(DIRECTORY ${manual_dir}/man1/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(DIRECTORY ${manual_dir}/completions/
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
