# Finds LCM (Debian: liblcm-dev, liblcm-bin): library, C++ headers and the type generator.
#   Lcm::Lcm            the library
#   LCM_GEN_EXECUTABLE  lcm-gen
#   LCM_LOGGER_EXECUTABLE, LCM_LOGPLAYER_EXECUTABLE  for tests; may be absent
find_path(LCM_INCLUDE_DIR NAMES lcm/lcm-cpp.hpp)
find_library(LCM_LIBRARY NAMES lcm)
find_program(LCM_GEN_EXECUTABLE NAMES lcm-gen)
find_program(LCM_LOGGER_EXECUTABLE NAMES lcm-logger)
find_program(LCM_LOGPLAYER_EXECUTABLE NAMES lcm-logplayer)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Lcm REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN_EXECUTABLE)
if(Lcm_FOUND AND NOT TARGET Lcm::Lcm)
  add_library(Lcm::Lcm UNKNOWN IMPORTED)
  set_target_properties(Lcm::Lcm PROPERTIES
    IMPORTED_LOCATION "${LCM_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${LCM_INCLUDE_DIR}")
endif()
mark_as_advanced(LCM_INCLUDE_DIR LCM_LIBRARY LCM_GEN_EXECUTABLE LCM_LOGGER_EXECUTABLE
                 LCM_LOGPLAYER_EXECUTABLE)
