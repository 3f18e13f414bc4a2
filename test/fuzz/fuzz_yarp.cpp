// A YARP recording. The input is cut at NUL bytes into an encoder log, a picture log and a picture
// (PPM, PGM, PNG or JPEG).
#include <array>

#include "bodyschema/imports/yarp_import.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::array<std::string_view, 3> parts;
  std::string_view rest = fuzz::as_text(data, size);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t end = std::min(rest.find('\0'), rest.size());
    parts[i] = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  parts[2] = rest;  // a picture holds NUL bytes of its own
  const auto put = [](std::string_view text, const char* name) {
    return fuzz::as_file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), name);
  };
  const auto recording = put(parts[0], "yarp/arm/data.log").parent_path().parent_path();
  put(parts[1], "yarp/left/data.log");
  put(parts[2], "yarp/left/00000001.ppm");
  put("Type: Bottle;\n[0] /arm [connected]\n", "yarp/arm/info.log");
  put("Type: Image;\n[0] /left [connected]\n", "yarp/left/info.log");
  YarpImportOptions options;
  options.encoders = {{"arm", {"a", "b"}}};
  options.combined_joints = {{"c", {{"a", 1.0}, {"b", 0.5}}}};
  options.left_images = "left";
  fuzz::refuse_or_accept(
      [&] { import_yarp(recording, options, Channels::with_prefix("FUZZ"), recording / "out.log"); });
  return 0;
}
