// Files that our own programs wrote and others may have touched: results on their way to a robot, a fleet's results,
// colours kept for the next start, a motion to be played. The input is cut at NUL bytes into summary.json, info.json,
// report.json, the colours and the motion.
#include <array>

#include "bodyschema/fleet/fleet_report.hpp"
#include "bodyschema/pipeline/export_correction.hpp"
#include "bodyschema/pipeline/looks_file.hpp"
#include "bodyschema/robot/motion_file.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

namespace {

std::filesystem::path put(std::string_view text, const std::string& name) {
  return fuzz::as_file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), name);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::array<std::string_view, 5> parts;
  std::string_view rest = fuzz::as_text(data, size);
  for (auto& part : parts) {
    part = rest.substr(0, std::min(rest.find('\0'), rest.size()));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
  }
  const auto summary = put(parts[0], "results/summary.json");
  fuzz::refuse_or_accept([&] { (void)read_correction(summary, true); });
  // Two logs of one robot: what is found in both is compared.
  for (const char* log : {"monday", "tuesday"}) {
    const auto folder = std::string("fleet/robot/") + log;
    put(parts[1], folder + "/info.json");
    put(parts[2], folder + "/report.json");
    put("diagnosed\n", folder + "/outcome.txt");
  }
  const auto results = summary.parent_path().parent_path() / "fleet";
  fuzz::refuse_or_accept([&] { (void)write_fleet_report(gather_fleet(results), results.parent_path() / "page"); });
  const auto looks = put(parts[3], "results/looks.json");
  fuzz::refuse_or_accept([&] { (void)read_looks(looks, "r"); });
  const auto motion = put(parts[4], "results/motion.csv");
  fuzz::refuse_or_accept(
      [&] { (void)MotionFile::read(motion, [](const std::string& name) { return name == "lift"; }); });
  return 0;
}
