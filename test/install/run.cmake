# Run by ctest (see tests.cmake): install, move, build the consumer against it, run the consumer.
function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} failed (${result}):\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${SCRATCH_DIR})
run("cmake --install" ${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${SCRATCH_DIR}/first)
# Nothing may depend on where it was installed to.
file(RENAME ${SCRATCH_DIR}/first ${SCRATCH_DIR}/moved)

set(configure ${CMAKE_COMMAND} -S ${CONSUMER_DIR} -G ${GENERATOR}
    -D CMAKE_PREFIX_PATH=${SCRATCH_DIR}/moved -D "CMAKE_CXX_FLAGS=${CXX_FLAGS}")
run("configuring the consumer" ${configure} -B ${SCRATCH_DIR}/build)
run("building the consumer" ${CMAKE_COMMAND} --build ${SCRATCH_DIR}/build)
run("the consumer" ${SCRATCH_DIR}/build/consumer ${CONSUMER_DIR}/pendulum.urdf bob)
if(NOT output MATCHES "pendulum: bob at \\(0.250, 0.000, -0.500\\) m")
  message(FATAL_ERROR "the consumer printed:\n${output}")
endif()

# All components at once: every package they need is found and linked.
run("configuring for all components" ${configure} -B ${SCRATCH_DIR}/everything -D EVERYTHING=ON)
run("building with all components" ${CMAKE_COMMAND} --build ${SCRATCH_DIR}/everything)

# A component that does not exist is refused by name.
execute_process(COMMAND ${configure} -B ${SCRATCH_DIR}/refused -D EXTRA_COMPONENT=attic
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
string(REGEX REPLACE "[ \n]+" " " output "${output}")
if(result EQUAL 0 OR NOT output MATCHES "no component 'attic'")
  message(FATAL_ERROR "asking for a component that does not exist was not refused:\n${output}")
endif()
