#include "bodyschema/core/rounded.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

/// With so many places behind the point (or, negative, zeros before it), and no zeros at the end.
std::string with_places(double value, int places) {
  const double unit = std::pow(10.0, -places);
  auto text = fmt::format("{:.{}f}", std::round(value / unit) * unit, std::max(0, places));
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

constexpr int kMostPlaces = 12;
constexpr double kRounding = 1e-9;  // 0.3 is three tenths

}  // namespace

RoundedInterval rounded(double value, double low, double high) {
  const double half = 0.5 * (high - low);
  const double places = -std::floor(std::log10(half / 3.0) + kRounding);
  if (!(half > 0.0) || !std::isfinite(places) || std::abs(places) > kMostPlaces) {
    return {fmt::format("{:.3g}", value), fmt::format("{:.3g}", low), fmt::format("{:.3g}", high)};
  }
  const int n = static_cast<int>(places);
  return {with_places(value, n), with_places(low, n), with_places(high, n)};
}

std::string roughly(double value) {
  const double order = std::floor(std::log10(std::abs(value)) + kRounding);
  if (!std::isfinite(order) || std::abs(order) > kMostPlaces) return fmt::format("{:.1g}", value);
  const bool begins_with_one = std::abs(value) < 2.0 * std::pow(10.0, order);
  return with_places(value, static_cast<int>(-order) + (begins_with_one ? 1 : 0));
}

}  // namespace bodyschema
