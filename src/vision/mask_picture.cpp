#include "bodyschema/vision/mask_picture.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema {
namespace {

constexpr std::uintmax_t kMaxBytes = 64u << 20;
constexpr int kMaxSide_px = 16384;

void write(const std::filesystem::path& file, const cv::Mat& picture) {
  std::vector<std::uint8_t> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(file.extension().string(), picture, bytes);
  } catch (const cv::Exception&) {
    // An unknown extension; reported below with the file's name.
  }
  if (!encoded) throw FileError(file.string() + ": cannot write such a picture, expected .png");
  if (file.has_parent_path()) make_folder(file.parent_path());
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

void write_mask_png(const std::filesystem::path& file, const BinaryMask& mask, const BinaryMask& valid, int n) {
  if (mask.empty()) throw FileError(file.string() + ": there is no mask to write");
  cv::Mat picture(mask.height(), mask.width(), CV_8UC1);
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      const bool known = valid.empty() || valid.at(u, v);
      picture.at<std::uint8_t>(v, u) = !known ? 128 : (mask.at(u, v) ? 255 : 0);
    }
  }
  cv::resize(picture, picture, {}, n, n, cv::INTER_NEAREST);
  write(file, picture);
}

Image read_picture(const std::filesystem::path& file, const std::function<void(PictureSize)>& check_size) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) throw FileError(file.string() + ": no such file");
  file_size_at_most(file, kMaxBytes);
  std::ifstream in(file, std::ios::binary);
  const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto size = picture_size(bytes);
  if (!size) throw FileError(file.string() + ": not a picture that can be read, expected PNG, JPEG, PPM or PGM");
  if (size->width < 1 || size->height < 1 || size->width > kMaxSide_px || size->height > kMaxSide_px) {
    throw FileError(file.string() + ": header says " + std::to_string(size->width) + "x" +
                    std::to_string(size->height) + " px; expected 1 to " + std::to_string(kMaxSide_px) + " a side");
  }
  if (check_size) check_size(*size);
  cv::Mat picture;
  try {
    picture = cv::imdecode(bytes, cv::IMREAD_ANYCOLOR);
  } catch (const cv::Exception&) {
    // Broken file; reported below.
  }
  if (picture.empty()) throw FileError(file.string() + ": not a picture that can be read");
  if (picture.channels() == 4) cv::cvtColor(picture, picture, cv::COLOR_BGRA2BGR);
  if (picture.channels() == 3) cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
  Image image(picture.cols, picture.rows, picture.channels());
  for (int v = 0; v < picture.rows; ++v) {
    std::copy_n(picture.ptr<std::uint8_t>(v),
                static_cast<std::size_t>(picture.cols) * static_cast<std::size_t>(picture.channels()),
                image.pixel(0, v));
  }
  return image;
}

}  // namespace bodyschema
