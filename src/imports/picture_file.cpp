#include "picture_file.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
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

Image read_png(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  check(picture_size(bytes).value_or(PictureSize{}), file);
  // Without its last chunk it was cut short, and the decoder may not mind.
  constexpr std::array<std::uint8_t, 4> kEnd = {'I', 'E', 'N', 'D'};
  const bool whole = std::search(bytes.end() - std::min<std::ptrdiff_t>(16, std::ssize(bytes)), bytes.end(),
                                 kEnd.begin(), kEnd.end()) != bytes.end();
  cv::Mat picture;
  try {
    if (whole) picture = cv::imdecode(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), cv::IMREAD_ANYCOLOR);
  } catch (const cv::Exception&) {
    // Said below.
  }
  if (picture.empty()) throw FileError(file.string() + ": PNG picture is broken or cut short");
  if (picture.channels() == 3) cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  Image image(picture.cols, picture.rows, picture.channels());
  const auto row = static_cast<std::size_t>(picture.cols) * static_cast<std::size_t>(picture.channels());
  for (int v = 0; v < picture.rows; ++v) std::copy_n(picture.ptr<std::uint8_t>(v), row, image.pixel(0, v));
  return image;
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
  file_size_at_most(file, kMaxPictureBytes);
  in.clear();
  in.seekg(0);
  const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return read_picture(bytes, file);
}

}  // namespace bodyschema
