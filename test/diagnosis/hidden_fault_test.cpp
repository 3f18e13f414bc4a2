#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "random_seed.hpp"
#include "simulated_log.hpp"

namespace bodyschema {
namespace {

TEST(Explore, One) {
  test::Simulated what;
  if (const char* s = std::getenv("X_SEED")) what.seed = std::atoi(s);
  if (const char* s = std::getenv("X_S")) what.seconds = std::atof(s);
  if (const char* s = std::getenv("X_HEAD")) what.head_moves = std::atoi(s);
  if (const char* f = std::getenv("X_FAULTS")) {
    std::string text = f;
    for (std::size_t at = 0; at < text.size();) {
      const auto end = std::min(text.find(' ', at), text.size());
      if (end > at) what.faults.push_back(text.substr(at, end - at));
      at = end + 1;
    }
  }
  test::SimulatedLog log(what);
  const auto r = log.diagnosis();
  std::cout << (std::getenv("X_FAULTS") ? std::getenv("X_FAULTS") : "healthy") << " => " << r.verdict << " | " << r.sentence << " | rms " << r.before.rms_px << " > " << r.after.rms_px << " crowded " << r.crowded << " " << (r.warnings.empty() ? "" : r.warnings[0]);
  std::cout << " found " << r.after.outline_found << " seen " << r.after.outline_where_seen << " thr " << r.z_threshold << " blocks " << r.blocks;
  for (auto& c : r.small_causes) std::cout << " small: " << c.sentence;
  for (auto& b : r.bars) if (b.z_before > 3.5) std::cout << " " << b.label << " " << b.z_before << ">" << b.z_after;
  for (auto& c : r.causes) { std::cout << " z " << c.z << " gain " << c.heldout_gain; for (auto& p : c.parameters) std::cout << " " << p.parameter << " " << p.estimate << " [" << p.ci95[0] << "," << p.ci95[1] << "]"; }
  std::cout << std::endl;
}

}  // namespace
}  // namespace bodyschema
