# cpack, in the build folder: one Debian package with programs, libraries, types, robots, service.
set(CPACK_PACKAGE_NAME bodyschema)
set(CPACK_PACKAGE_VENDOR "Body Schema authors")
set(CPACK_PACKAGE_CONTACT "Body Schema authors <bodyschema@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/package/system_files.cmake)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"Estimates the joint offsets of a robot's arm while it works, from the
silhouettes its own cameras see. Speaks LCM. With a simulated iCub, replay
and evaluation of recorded logs, and the libraries to link against.")
# Libraries by what the programs link; rendering is opened at run time, so it is named here.
# Needs dpkg-shlibdeps and file (packages dpkg-dev, file).
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libegl1, libegl-mesa0 | libegl-vendor, libgl1-mesa-dri")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "liblcm-bin, python3-venv")
# For those who link against the libraries.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS
  "snakemake, libosmesa6, liblcm-java, libeigen3-dev, libopencv-calib3d-dev, libopencv-imgcodecs-dev, liblcm-dev, libyaml-cpp-dev, libspdlog-dev, libassimp-dev, libmeshoptimizer-dev, liburdfdom-dev, liborocos-kdl-dev, libjpeg-dev, nlohmann-json3-dev, libtinyxml2-dev")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
  ${PROJECT_SOURCE_DIR}/cmake/package/postinst ${PROJECT_SOURCE_DIR}/cmake/package/prerm
  ${PROJECT_SOURCE_DIR}/cmake/package/postrm ${PROJECT_SOURCE_DIR}/cmake/package/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION TRUE)
include(CPack)
