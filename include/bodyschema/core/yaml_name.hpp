#pragma once

#include <string>

namespace bodyschema {

/// A name as YAML takes it for this text and nothing else: in quotes where it has other characters than letters, digits
/// and _ . / - (a URDF may call a joint "a: b", or begin its name with *).
std::string yaml_name(const std::string& name);

}  // namespace bodyschema
