# What `cmake --install` puts where, below the prefix:
#   bin/                        every program of apps/
#   lib/, include/bodyschema/   one static library and one folder of headers per storey
#   lib/cmake/bodyschema/       find_package(bodyschema COMPONENTS robot silhouette ...)
#   share/bodyschema/           config/, meshes/, workflow/ and import/, side by side as in the source tree, so that
#                               the relative paths inside the configurations hold in both places
# Nothing installed holds an absolute path: the prefix may be moved.
include(CMakePackageConfigHelpers)

set(BODYSCHEMA_INSTALL_CMAKEDIR ${CMAKE_INSTALL_LIBDIR}/cmake/bodyschema)
set(BODYSCHEMA_INSTALL_SHAREDIR ${CMAKE_INSTALL_DATADIR}/bodyschema)

# bodyschema_package_of(<linked item> <variable>)
#   The lines a package configuration needs so that the linked item exists for the consumer; empty
#   for items that need none. Unknown items stop the configuration: an install that lacks one of
#   them would only fail at the user's.
function(bodyschema_package_of item variable)
  set(lines "")
  string(REGEX REPLACE "::.*" "" package ${item})  # of our own finders, Find<package>.cmake
  if(item MATCHES "^Eigen3::")
    set(lines "find_dependency(Eigen3 NO_MODULE)")
  elseif(item MATCHES "^Threads::")
    set(lines "find_dependency(Threads)")
  elseif(item MATCHES "^(spdlog|fmt|assimp|nlohmann_json|CLI11|tinyxml2|meshoptimizer)::")
    set(lines "find_dependency(${CMAKE_MATCH_1})")
  elseif(item MATCHES "^(yaml-cpp::)?yaml-cpp$")
    set(lines "find_dependency(yaml-cpp)")
  elseif(item MATCHES "^opencv_(.+)$")
    set_property(GLOBAL APPEND PROPERTY BODYSCHEMA_FINDERS ${PROJECT_SOURCE_DIR}/cmake/FindOpenCV.cmake)
    set(lines "find_dependency(OpenCV COMPONENTS ${CMAKE_MATCH_1})")
  elseif(item MATCHES "^urdfdom_headers::")
    set(lines "find_dependency(urdfdom_headers)")
  elseif(item MATCHES "^(urdfdom::)?urdfdom_|^urdfdom::")
    set(lines "find_dependency(urdfdom_headers)\nfind_dependency(urdfdom)")
  elseif(item MATCHES "^orocos-kdl$")
    set(lines "find_dependency(orocos_kdl)")
  elseif(item MATCHES "^(lcm|lcm-static|lcm::lcm|lcm::lcm-static)$")
    set(lines "find_dependency(lcm)")
  elseif(item MATCHES "^OpenGL::(EGL|OpenGL|GL)$")
    set(lines "find_dependency(OpenGL COMPONENTS EGL OpenGL)")
  elseif(item MATCHES "^(JPEG|ZLIB|PNG)::")
    set(lines "find_dependency(${CMAKE_MATCH_1})")
  elseif(item MATCHES "^PkgConfig::(.+)$")
    # The imported target is made again at the consumer's from the same modules.
    set(prefix ${CMAKE_MATCH_1})
    get_property(modules CACHE ${prefix}_MODULE_NAME PROPERTY VALUE)
    if(NOT modules)
      set(modules ${${prefix}_MODULE_NAME})
    endif()
    if(NOT modules)
      message(FATAL_ERROR "cmake/Install.cmake: cannot tell the pkg-config module of ${item}")
    endif()
    set(lines "find_dependency(PkgConfig)\npkg_check_modules(${prefix} REQUIRED IMPORTED_TARGET ${modules})")
  elseif(EXISTS ${PROJECT_SOURCE_DIR}/cmake/Find${package}.cmake)
    set_property(GLOBAL APPEND PROPERTY BODYSCHEMA_FINDERS ${PROJECT_SOURCE_DIR}/cmake/Find${package}.cmake)
    set(lines "find_dependency(${package})")
  elseif(item MATCHES "^(dl|m|rt|pthread|stdc\\+\\+fs|-.*)$")
    # Part of the system.
  else()
    message(FATAL_ERROR "cmake/Install.cmake: a library links '${item}', but "
      "bodyschema_package_of() does not know which package brings it; add it there.")
  endif()
  set(${variable} "${lines}" PARENT_SCOPE)
endfunction()

# ---- libraries, headers and their exported targets -------------------------------------------
get_property(libraries GLOBAL PROPERTY BODYSCHEMA_LIBRARIES)
# Ground floor first, and before the storeys what is none (the generated LCM types).
set(installed_folders "")
foreach(library IN LISTS libraries)
  get_target_property(folder ${library} EXPORT_NAME)
  if(NOT folder)
    string(REGEX REPLACE "^bodyschema_" "" folder ${library})
    set_target_properties(${library} PROPERTIES EXPORT_NAME ${folder})
  endif()
  if(folder IN_LIST BODYSCHEMA_STOREYS)
    list(APPEND installed_folders ${folder})
  else()
    list(PREPEND installed_folders ${folder})
  endif()
  set(library_of_${folder} ${library})
endforeach()

foreach(folder IN LISTS installed_folders)
  set(library ${library_of_${folder}})
  install(TARGETS ${library} EXPORT bodyschema-${folder}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT bodyschema-${folder} FILE bodyschema-${folder}-targets.cmake
          NAMESPACE bodyschema:: DESTINATION ${BODYSCHEMA_INSTALL_CMAKEDIR})
  if(EXISTS ${PROJECT_SOURCE_DIR}/include/bodyschema/${folder})
    install(DIRECTORY include/bodyschema/${folder}
            DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/bodyschema FILES_MATCHING PATTERN "*.hpp")
  endif()

  set(links "")
  set(packages "")
  get_target_property(items ${library} INTERFACE_LINK_LIBRARIES)
  foreach(item IN LISTS items)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" item "${item}")
    string(REGEX REPLACE "^\\$<BUILD_INTERFACE:.*>$" "" item "${item}")
    if(item STREQUAL "" OR item STREQUAL "items-NOTFOUND")
      continue()
    endif()
    if(item MATCHES "^bodyschema(::|_)(.+)$")
      list(APPEND links ${CMAKE_MATCH_2})
      continue()
    endif()
    bodyschema_package_of(${item} lines)
    list(APPEND packages "${lines}")
  endforeach()
  list(REMOVE_DUPLICATES packages)
  list(REMOVE_DUPLICATES links)
  list(JOIN packages "\n" packages)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/package/bodyschema-${folder}-packages.cmake @ONLY
       CONTENT "# What bodyschema::@folder@ is built on.
set(_bodyschema_links \"@links@\")
if(_bodyschema_find_packages)
@packages@
endif()
")
  install(FILES ${PROJECT_BINARY_DIR}/package/bodyschema-${folder}-packages.cmake
          DESTINATION ${BODYSCHEMA_INSTALL_CMAKEDIR})
endforeach()

configure_package_config_file(cmake/bodyschemaConfig.cmake.in
  ${PROJECT_BINARY_DIR}/package/bodyschemaConfig.cmake
  INSTALL_DESTINATION ${BODYSCHEMA_INSTALL_CMAKEDIR}
  PATH_VARS BODYSCHEMA_INSTALL_SHAREDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/bodyschemaConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
get_property(finders GLOBAL PROPERTY BODYSCHEMA_FINDERS)
list(REMOVE_DUPLICATES finders)
install(FILES ${PROJECT_BINARY_DIR}/package/bodyschemaConfig.cmake
              ${PROJECT_BINARY_DIR}/package/bodyschemaConfigVersion.cmake ${finders}
        DESTINATION ${BODYSCHEMA_INSTALL_CMAKEDIR})

# ---- programs, configurations, robots ----------------------------------------------------------
get_property(targets DIRECTORY apps PROPERTY BUILDSYSTEM_TARGETS)
foreach(target IN LISTS targets)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "EXECUTABLE")
    list(APPEND BODYSCHEMA_PROGRAMS ${target})
    install(TARGETS ${target} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endforeach()
foreach(folder IN ITEMS config meshes workflow import)
  install(DIRECTORY ${folder} DESTINATION ${BODYSCHEMA_INSTALL_SHAREDIR}
          PATTERN "__pycache__" EXCLUDE PATTERN "service" EXCLUDE)
endforeach()
# As in the source tree, so that the links between the pages hold.
install(FILES LICENSE README.md SECURITY.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES bench/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/bench)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN "__pycache__" EXCLUDE)

# ---- the service ---------------------------------------------------------------------------------
install(FILES config/service/bodyschemad.service DESTINATION lib/systemd/system)
install(FILES config/service/60-bodyschema.conf DESTINATION lib/sysctl.d)

include(LcmBindings)
include(Manual)
include(Package)

if(BODYSCHEMA_BUILD_TESTS)
  include(${PROJECT_SOURCE_DIR}/test/install/tests.cmake)
endif()
