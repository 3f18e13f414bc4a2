# The message types for other languages, from the .lcm files collected by lcm_generate():
#   share/bodyschema/python/        packages for Python with PyPI's lcm (add the folder to PYTHONPATH)
#   share/java/bodyschema-lcmtypes.jar   for lcm-spy and Java programs; only where a JDK and lcm.jar are
get_property(lcm_files GLOBAL PROPERTY BODYSCHEMA_LCM_FILES)
if(NOT lcm_files)
  return()
endif()

set(python_dir ${PROJECT_BINARY_DIR}/lcmtypes-python)
add_custom_command(OUTPUT ${python_dir}/stamp
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${python_dir}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${python_dir}
  COMMAND ${LCM_GEN_EXECUTABLE} --python --ppath ${python_dir} ${lcm_files}
  COMMAND ${CMAKE_COMMAND} -E touch ${python_dir}/stamp
  DEPENDS ${lcm_files} COMMENT "Message types for Python" VERBATIM)
add_custom_target(lcmtypes_python ALL DEPENDS ${python_dir}/stamp)
install(DIRECTORY ${python_dir}/ DESTINATION ${BODYSCHEMA_INSTALL_SHAREDIR}/python
        FILES_MATCHING PATTERN "*.py")

find_program(BODYSCHEMA_JAVAC javac)
find_program(BODYSCHEMA_JAR jar)
find_file(BODYSCHEMA_LCM_JAR lcm.jar PATHS /usr/share/java /usr/local/share/java)
mark_as_advanced(BODYSCHEMA_JAVAC BODYSCHEMA_JAR BODYSCHEMA_LCM_JAR)
if(BODYSCHEMA_JAVAC AND BODYSCHEMA_JAR AND BODYSCHEMA_LCM_JAR)
  set(java_dir ${PROJECT_BINARY_DIR}/lcmtypes-java)
  set(types_jar ${PROJECT_BINARY_DIR}/bodyschema-lcmtypes.jar)
  set(java_sources "")
  foreach(file IN LISTS lcm_files)
    file(STRINGS ${file} package REGEX "^package ")
    string(REGEX REPLACE "^package +([A-Za-z0-9_]+).*" "\\1" package "${package}")
    get_filename_component(name ${file} NAME_WE)
    string(REGEX REPLACE "^${package}_" "" type ${name})
    list(APPEND java_sources ${java_dir}/${package}/${type}.java)
  endforeach()
  # Java 8 byte code: lcm.jar and the machines of many labs are that old.
  add_custom_command(OUTPUT ${types_jar}
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${java_dir}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${java_dir}/classes
    COMMAND ${LCM_GEN_EXECUTABLE} --java --jpath ${java_dir} ${lcm_files}
    COMMAND ${BODYSCHEMA_JAVAC} -nowarn -Xlint:-options --release 8 -cp ${BODYSCHEMA_LCM_JAR}
            -d ${java_dir}/classes ${java_sources}
    COMMAND ${BODYSCHEMA_JAR} cf ${types_jar} -C ${java_dir}/classes .
    DEPENDS ${lcm_files} COMMENT "Message types for Java" VERBATIM)
  add_custom_target(lcmtypes_jar ALL DEPENDS ${types_jar})
  install(FILES ${types_jar} DESTINATION ${CMAKE_INSTALL_DATADIR}/java)
else()
  message(STATUS "No JDK or no lcm.jar: the message types for Java (lcm-spy) are not built "
                 "(scripts/setup --tests installs both)")
endif()
