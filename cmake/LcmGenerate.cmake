# lcm_generate(<target> FILES file.lcm...)
#   An interface library whose users see the C++ classes that lcm-gen makes of FILES, as
#   <package/type.hpp>. Files are named <package>_<type>.lcm. Generated headers lie in
#   <build>/lcmtypes and are installed beside ours; the .lcm files go to share/bodyschema/lcmtypes.
include_guard()
find_package(Lcm REQUIRED)

function(lcm_generate target)
  cmake_parse_arguments(ARG "" "" "FILES" ${ARGN})
  set(out ${PROJECT_BINARY_DIR}/lcmtypes)
  set(inputs)
  set(headers)
  foreach(file IN LISTS ARG_FILES)
    get_filename_component(input ${file} ABSOLUTE)
    file(STRINGS ${input} package_line REGEX "^package ")
    string(REGEX REPLACE "^package +([A-Za-z0-9_]+).*" "\\1" package "${package_line}")
    get_filename_component(name ${file} NAME_WE)
    string(REGEX REPLACE "^${package}_" "" type ${name})
    set(header ${out}/${package}/${type}.hpp)
    add_custom_command(OUTPUT ${header}
      COMMAND ${LCM_GEN_EXECUTABLE} --cpp --cpp-std c++11 --cpp-hpath ${out} ${input}
      DEPENDS ${input} COMMENT "lcm-gen ${name}" VERBATIM)
    list(APPEND inputs ${input})
    list(APPEND headers ${header})
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${package})
  endforeach()
  install(FILES ${inputs} DESTINATION ${CMAKE_INSTALL_DATADIR}/bodyschema/lcmtypes)

  add_custom_target(${target}_headers DEPENDS ${headers})
  add_library(${target} INTERFACE)
  string(REGEX REPLACE "^bodyschema_" "" export_name ${target})
  add_library(bodyschema::${export_name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${export_name})
  add_dependencies(${target} ${target}_headers)
  # SYSTEM: generated code is not held to our warnings.
  target_include_directories(${target} SYSTEM INTERFACE
    $<BUILD_INTERFACE:${out}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} INTERFACE Lcm::Lcm)
  set_property(GLOBAL APPEND PROPERTY BODYSCHEMA_LIBRARIES ${target})
  set_property(GLOBAL APPEND PROPERTY BODYSCHEMA_LCM_FILES ${inputs})
endfunction()
