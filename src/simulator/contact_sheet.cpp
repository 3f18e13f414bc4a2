#include "bodyschema/simulator/contact_sheet.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema::simulator {
namespace {

constexpr int kGap_px = 2;

}  // namespace

ContactSheet::ContactSheet(int first, int count, int columns, int rows)
    : first_(first), count_(std::max(1, count)), columns_(columns), rows_(rows) {}

void ContactSheet::add(const SimulatedFrame& frame) {
  const int places = std::min(columns_ * rows_, count_);
  const auto place = static_cast<int>(pictures_.size());
  if (place >= places) return;
  // The middle of the place's share of the frames.
  if (frame.index < first_ + (2 * place + 1) * count_ / (2 * places)) return;
  const std::size_t camera = frame.cameras.size() > 1 && place % 2 == 1 ? 1 : 0;
  if (!frame.cameras[camera]) return;
  const CameraFrame& shot = *frame.cameras[camera];
  if (!shot.image.empty()) {
    pictures_.push_back(shot.image);
  } else if (!shot.silhouette.empty()) {
    Image mask(shot.silhouette.width(), shot.silhouette.height(), 3);
    for (std::size_t i = 0; i < mask.data.size(); ++i) mask.data[i] = shot.coverage[i / 3];
    pictures_.push_back(std::move(mask));
  }
}

Image ContactSheet::image() const {
  if (pictures_.empty()) return {};
  const int width = pictures_.front().width, height = pictures_.front().height;
  const int rows = (static_cast<int>(pictures_.size()) + columns_ - 1) / columns_;
  Image sheet(columns_ * (width + kGap_px) - kGap_px, rows * (height + kGap_px) - kGap_px, 3);
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    const int u0 = static_cast<int>(i) % columns_ * (width + kGap_px);
    const int v0 = static_cast<int>(i) / columns_ * (height + kGap_px);
    for (int v = 0; v < std::min(height, pictures_[i].height); ++v) {
      std::copy_n(pictures_[i].pixel(0, v), 3 * std::min(width, pictures_[i].width), sheet.pixel(u0, v0 + v));
    }
  }
  return sheet;
}

void ContactSheet::write(const std::filesystem::path& file) const {
  const Image sheet = image();
  if (sheet.empty()) throw FileError(file.string() + ": there is no picture to write");
  cv::Mat bgr(sheet.height, sheet.width, CV_8UC3);
  for (int v = 0; v < sheet.height; ++v) {
    for (int u = 0; u < sheet.width; ++u) {
      const auto* p = sheet.pixel(u, v);
      bgr.at<cv::Vec3b>(v, u) = {p[2], p[1], p[0]};
    }
  }
  std::vector<std::uint8_t> bytes;
  if (file.extension() != ".png" || !cv::imencode(".png", bgr, bytes)) {
    throw FileError(file.string() + ": cannot write such a picture, expected .png");
  }
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace bodyschema::simulator
