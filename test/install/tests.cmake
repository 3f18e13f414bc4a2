# Installs the build into a scratch prefix, moves the prefix, and builds and runs consumer/ on it.
add_test(NAME install.consumer
  COMMAND ${CMAKE_COMMAND}
    -D BUILD_DIR=${PROJECT_BINARY_DIR}
    -D CONSUMER_DIR=${PROJECT_SOURCE_DIR}/test/install/consumer
    -D SCRATCH_DIR=${PROJECT_BINARY_DIR}/test-install
    -D GENERATOR=${CMAKE_GENERATOR}
    -D CXX_FLAGS=${CMAKE_CXX_FLAGS}
    -P ${PROJECT_SOURCE_DIR}/test/install/run.cmake)
set_tests_properties(install.consumer PROPERTIES LABELS install TIMEOUT 300)
