# Run by ctest (see tests.cmake): the pages agree with the tree. Every storey is described, in order;
# every link to a file or a heading leads somewhere.
file(READ ${SOURCE_DIR}/docs/architecture.md page)
string(REGEX MATCHALL "\n\\| `[a-z_]+` \\|" rows "${page}")
string(REGEX REPLACE "[^a-z_;]" "" rows "${rows}")
if(NOT rows STREQUAL "${STOREYS}")
  message(SEND_ERROR "docs/architecture.md describes\n  ${rows}\nbut the storeys are\n  ${STOREYS}")
endif()

include(${CMAKE_CURRENT_LIST_DIR}/links.cmake)
file(GLOB_RECURSE pages ${SOURCE_DIR}/docs/*.md)
check_links(${pages} ${SOURCE_DIR}/README.md ${SOURCE_DIR}/SECURITY.md ${SOURCE_DIR}/bench/README.md)

# The port that the page on the service names is the one that its unit opens.
file(READ ${SOURCE_DIR}/docs/launch_at_boot.md page)
file(READ ${SOURCE_DIR}/config/service/bodyschemad.service unit)
string(REGEX MATCH "BODYSCHEMAD_OPTIONS=--page ([0-9]+)" named "${page}")
if(NOT named OR NOT unit MATCHES "\nSocketBindAllow=ipv4:tcp:${CMAKE_MATCH_1}\n")
  message(SEND_ERROR "docs/launch_at_boot.md and the unit do not agree on the live page's port")
endif()
