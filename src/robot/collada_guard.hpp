#pragma once

#include <string>
#include <string_view>

namespace bodyschema {

/// Why a COLLADA text must not be given to the mesh reader. That reader follows nodes recursively,
/// so elements must not nest deeper than 100, nodes not instance each other in a cycle or a chain
/// longer than 100, and the scene not unfold to more than 100 000 nodes; it loops for ever on an
/// index list that holds anything but whole numbers; and it reads past arrays that are shorter than their
/// accessor says. Empty when the text is harmless.
std::string collada_danger(std::string_view text);

}  // namespace bodyschema
