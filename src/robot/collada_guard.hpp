#pragma once

#include <string>
#include <string_view>

namespace bodyschema {

/// Why a COLLADA text must not be given to the mesh reader, which follows nodes recursively: elements
/// nest deeper than 100, nodes instance each other in a cycle or a chain longer than 100, or the scene
/// would unfold to more than 100 000 nodes. Empty when it is harmless.
std::string collada_danger(std::string_view text);

}  // namespace bodyschema
