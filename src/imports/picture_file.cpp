#include "picture_file.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <utility>
#include <vector>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"
#include "bodyschema/core/picture_size.hpp"
#include "netpbm.hpp"

namespace bodyschema {
namespace {

constexpr std::uintmax_t kMaxPictureBytes = 64u << 20;
constexpr std::array<std::uint8_t, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

void check(const PictureSize& size, const std::filesystem::path& file) {
  if (size.width >= 1 && size.height >= 1 && size.width <= kMaxSide_px && size.height <= kMaxSide_px) return;
  throw FileError(file.string() + ": header says " + std::to_string(size.width) + "x" + std::to_string(size.height) +
                  " px; expected 1 to " + std::to_string(kMaxSide_px) + " a side");
}

Image image_of(const cv::Mat& picture) {
  Image image(picture.cols, picture.rows, picture.channels());
  const auto row = static_cast<std::size_t>(picture.cols) * static_cast<std::size_t>(picture.channels());
  for (int v = 0; v < picture.rows; ++v) std::copy_n(picture.ptr<std::uint8_t>(v), row, image.pixel(0, v));
  return image;
}

cv::Mat decode_png(std::span<const std::uint8_t> bytes, int flags, const std::filesystem::path& file) {
  check(picture_size(bytes).value_or(PictureSize{}), file);
  // Without its last chunk it was cut short, and the decoder may not mind.
  constexpr std::array<std::uint8_t, 4> kEnd = {'I', 'E', 'N', 'D'};
  const bool whole = std::search(bytes.end() - std::min<std::ptrdiff_t>(16, std::ssize(bytes)), bytes.end(),
                                 kEnd.begin(), kEnd.end()) != bytes.end();
  cv::Mat picture;
  try {
    if (whole) picture = cv::imdecode(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), flags);
  } catch (const cv::Exception&) {
    // Said below.
  }
  if (picture.empty()) throw FileError(file.string() + ": PNG picture is broken or cut short");
  return picture;
}

Image read_png(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  cv::Mat picture = decode_png(bytes, cv::IMREAD_ANYCOLOR, file);
  if (picture.channels() == 3) cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  return image_of(picture);
}

/// Whether all pixels are alike.
bool is_plain(const Image& image) {
  const auto n = static_cast<std::size_t>(image.channels);
  for (std::size_t i = n; i < image.data.size(); ++i) {
    if (image.data[i] != image.data[i - n]) return false;
  }
  return true;
}

/// The alpha channel of a PNG, where it has one that is not the same all over.
std::optional<Image> alpha_of(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  cv::Mat picture = decode_png(bytes, cv::IMREAD_UNCHANGED, file);
  if (picture.channels() != 4) return std::nullopt;
  if (picture.depth() == CV_16U) picture.convertTo(picture, CV_8U, 1.0 / 257.0);
  cv::Mat channel;
  cv::extractChannel(picture, channel, 3);
  Image alpha = image_of(channel);
  if (is_plain(alpha)) return std::nullopt;
  return alpha;
}

std::vector<std::uint8_t> bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FileError(file.string() + ": picture cannot be opened");
  file_size_at_most(file, kMaxPictureBytes);
  return {std::istreambuf_iterator<char>(in), {}};
}

Image read_jpeg(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  const PictureSize size = picture_size(bytes).value_or(PictureSize{});
  check(size, file);
  ImageView view;
  view.width = size.width;
  view.height = size.height;
  view.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
  view.data = {bytes.data(), bytes.size()};
  Image image;
  const DecodeResult result = unpack(view, image);
  if (!result.ok()) throw FileError(file.string() + ": " + result.detail);
  return image;
}

bool is_png(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kPng.size() && std::equal(kPng.begin(), kPng.end(), bytes.begin());
}

}  // namespace

bool is_jpeg(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 2 && bytes[0] == 0xFF && bytes[1] == 0xD8;
}

Image read_picture(std::span<const std::uint8_t> bytes, const std::filesystem::path& where) {
  if (is_png(bytes)) return read_png(bytes, where);
  if (is_jpeg(bytes)) return read_jpeg(bytes, where);
  throw FileError(where.string() + ": neither PNG nor JPEG");
}

Image read_picture_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FileError(file.string() + ": picture cannot be opened");
  std::array<std::uint8_t, 8> begin{};
  in.read(reinterpret_cast<char*>(begin.data()), begin.size());
  if (!is_png(begin) && !is_jpeg(begin)) return read_netpbm(file);
  return read_picture(bytes_of(file), file);
}

Image read_mask_file(const std::filesystem::path& file) {
  Image colours = read_picture_file(file);
  const auto bytes = bytes_of(file);
  std::optional<Image> alpha = is_png(bytes) ? alpha_of(bytes, file) : std::nullopt;
  if (!alpha) return colours;
  if (is_plain(colours)) return std::move(*alpha);
  Image mask = colours, other = *alpha;
  if (to_mask(mask).ok() && to_mask(other).ok() && mask.data == other.data) return colours;
  throw FileError(file.string() +
                  ": mask whose alpha channel is another than its colours show; expected a gray picture without one: 0 "
                  "background, 128 not known, 255 robot");
}

}  // namespace bodyschema
