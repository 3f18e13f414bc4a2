# Run by cpack after it has staged the install tree and before it makes the package; `cmake --install`
# never comes here. Adds the files outside the prefix and those that only make sense below /usr.
set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY})
if(root STREQUAL "")
  message(FATAL_ERROR "this script is for cpack")
endif()

file(WRITE ${root}/etc/bodyschema/estimator.yaml
"# The robot that bodyschemad calibrates. Everything not said here is as in the included file, where
# every key is explained; `bodyschemad --config /etc/bodyschema/estimator.yaml --print-config` shows
# the values in force. For another robot, include another file.
include: [/usr/share/bodyschema/config/icub_right/estimator.yaml]
")
file(WRITE ${root}/etc/default/bodyschemad
"# Read by bodyschemad.service.
# Which LCM network to join. The default keeps all messages on this machine; ttl=1 reaches the
# machines on the same network.
#LCM_DEFAULT_URL=udpm://239.255.76.67:7667?ttl=1
# Further options of bodyschemad.
#BODYSCHEMAD_OPTIONS=
")
# Python finds the message types without setting PYTHONPATH.
file(WRITE ${root}/usr/lib/python3/dist-packages/bodyschema-lcmtypes.pth
"/usr/share/bodyschema/python
")
