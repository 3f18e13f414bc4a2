#include "bodyschema/search/fastest_engine.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <thread>

#include "bodyschema/core/digest.hpp"
#include "bodyschema/core/user_cache.hpp"
#include "bodyschema/gl/context.hpp"

namespace bodyschema {
namespace {

constexpr double kTiming_s = 0.5;
constexpr const char* kHead = "bodyschema engine timings 1";

std::string key_of(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                   const SilhouetteOptions& options, std::size_t silhouettes, const std::string& gl) {
  Digest digest;
  digest.add(gl).add(fmt::format(" {} cores, {} threads, {} silhouettes", std::thread::hardware_concurrency(),
                                 options.threads, silhouettes));
  for (const auto& k : cameras) digest.add(fmt::format(" {}x{} {} {}", k.width, k.height, k.fx, k.fy));
  for (const auto& part : model.parts) {
    digest.add(part.vertices.data(), part.vertices.size() * sizeof(part.vertices[0]));
    digest.add(part.triangles.data(), part.triangles.size() * sizeof(part.triangles[0]));
  }
  return digest.text();
}

/// A line for each: engine, pass or -, milliseconds or -1 where it failed.
std::optional<std::vector<EngineTiming>> parse(const std::string& text) {
  std::istringstream lines(text);
  std::string head;
  if (!std::getline(lines, head) || head != kHead) return std::nullopt;
  std::vector<EngineTiming> timings;
  for (EngineTiming t; lines >> t.engine >> t.gl_pass >> t.ms; timings.push_back(t)) {
    if (t.gl_pass == "-") t.gl_pass.clear();
    t.error = t.ms < 0.0 ? "failed when it was measured" : "";
    const bool known = t.engine == "contour" ? t.gl_pass.empty()
                                             : t.engine == "atlas" && (t.gl_pass == "raster" || t.gl_pass == "compute");
    if (!known) return std::nullopt;
  }
  if (timings.size() != 3 || !lines.eof()) return std::nullopt;
  return timings;
}

}  // namespace

std::vector<EngineTiming> remembered_timings(const std::string& key,
                                             const std::function<std::vector<EngineTiming>()>& measure) {
  const std::string name = "engines/" + key;
  if (const auto text = read_cache(name)) {
    if (auto timings = parse(*text)) return *std::move(timings);
  }
  auto timings = measure();
  std::string text = std::string(kHead) + "\n";
  for (const auto& t : timings) {
    text += fmt::format("{} {} {:.4f}\n", t.engine, t.gl_pass.empty() ? "-" : t.gl_pass, t.error.empty() ? t.ms : -1.0);
  }
  write_cache(name, text);
  return timings;
}

SilhouetteOptions fastest_of(std::span<const EngineTiming> timings, const SilhouetteOptions& options,
                             std::string& reason) {
  SilhouetteOptions chosen = options;
  if (options.engine == "auto") chosen.engine = "contour";
  const EngineTiming* best = nullptr;
  std::string figures;
  for (const auto& t : timings) {
    figures += fmt::format("{}{}{}{} {}", figures.empty() ? "" : ", ", t.engine, t.gl_pass.empty() ? "" : " ",
                           t.gl_pass, t.error.empty() ? fmt::format("{:.2f} ms", t.ms) : t.error);
    const bool open = (options.engine == "auto" || options.engine == t.engine) &&
                      (options.gl_pass == "auto" || t.gl_pass.empty() || options.gl_pass == t.gl_pass);
    if (open && t.error.empty() && (best == nullptr || t.ms < best->ms)) best = &t;
  }
  if (best != nullptr) {
    chosen.engine = best->engine;
    if (!best->gl_pass.empty()) chosen.gl_pass = best->gl_pass;
  }
  reason = "auto: the fastest of " + figures;
  return chosen;
}

SilhouetteOptions fastest_engine(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                                 const SilhouetteOptions& options, std::size_t silhouettes, std::string& reason) {
  SilhouetteOptions chosen = options;
  if (options.engine == "contour" || (options.engine == "atlas" && options.gl_pass != "auto")) {
    reason = "the configuration asks for " + options.engine + (options.engine == "atlas" ? " " + options.gl_pass : "");
    return chosen;
  }
  if (options.engine != "auto" && options.engine != "atlas") return chosen;  // refused when it is made
  std::string gl;
  try {
    const auto context = gl::Context::create(options.gl_platform);
    gl = context->description();
    if (context->is_software()) {
      if (options.engine == "auto") chosen.engine = "contour";
      if (options.engine == "atlas") chosen.gl_pass = "compute";
      reason = (options.engine == "auto" ? "auto: no GPU, " : "the configuration asks for atlas; ") + gl +
               " draws in software";
      return chosen;
    }
  } catch (const gl::ContextError& error) {
    reason = std::string("auto: ") + error.what();
    if (options.engine == "auto") chosen.engine = "contour";
    return chosen;
  }
  const auto timings = remembered_timings(key_of(model, cameras, options, silhouettes, gl), [&] {
    return time_engines(model, cameras, options, silhouettes, kTiming_s);
  });
  return fastest_of(timings, options, reason);
}

}  // namespace bodyschema
