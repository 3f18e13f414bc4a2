#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

namespace bodyschema::test {

/// What random tests draw from: 1, so that a run is like the one before; BODYSCHEMA_SEED=7 for another one, and
/// BODYSCHEMA_SEED=fresh (ctest -C fresh -L fresh) for one that nobody has seen. Printed, to repeat what failed.
inline std::uint64_t seed() {
  static const std::uint64_t value = [] {
    const char* given = std::getenv("BODYSCHEMA_SEED");
    const std::string text = given == nullptr ? "1" : given;
    const std::uint64_t s = text == "fresh" ? std::random_device{}() : std::strtoull(text.c_str(), nullptr, 10);
    std::cout << "BODYSCHEMA_SEED=" << s << std::endl;
    return s;
  }();
  return value;
}

}  // namespace bodyschema::test
