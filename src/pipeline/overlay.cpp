#include "bodyschema/pipeline/overlay.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {
namespace {

const cv::Scalar kRed(255, 60, 60);
const cv::Scalar kGreen(60, 230, 90);
constexpr int kCaptionHeight_px = 26;

cv::Mat to_matrix(const Image& image) {
  const int type = image.channels == 3 ? CV_8UC3 : CV_8UC1;
  cv::Mat view(image.height, image.width, type, const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat rgb;
  if (image.channels == 3) {
    rgb = view.clone();
  } else {
    cv::cvtColor(view, rgb, cv::COLOR_GRAY2RGB);
  }
  return rgb;
}

void draw_outline(cv::Mat& picture, const BinaryMask& mask, int enlargement, const cv::Scalar& colour) {
  if (mask.empty()) return;
  cv::Mat bits(mask.height(), mask.width(), CV_8UC1);
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) bits.at<std::uint8_t>(v, u) = mask.at(u, v) ? 255 : 0;
  }
  cv::Mat large;
  cv::resize(bits, large, {}, enlargement, enlargement, cv::INTER_NEAREST);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(large, outlines, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  cv::drawContours(picture, outlines, -1, colour, 1, cv::LINE_AA);
}

void tint(cv::Mat& picture, const BinaryMask& mask, int enlargement) {
  if (mask.empty()) return;
  const cv::Vec3b orange(255, 150, 0);
  constexpr double kOpaque = 0.55;
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      if (!mask.at(u / enlargement, v / enlargement)) continue;
      auto& pixel = picture.at<cv::Vec3b>(v, u);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = cv::saturate_cast<std::uint8_t>((1.0 - kOpaque) * pixel[c] + kOpaque * orange[c]);
      }
    }
  }
}

}  // namespace

std::vector<OverlayView> overlay_views(Pipeline& pipeline, const Observation& observation, const Estimate& estimate) {
  std::vector<OverlayView> views;
  for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
    if (!observation.cameras[c]) continue;
    views.push_back({&observation.cameras[c]->image, pipeline.estimator().predicted_silhouette(observation, c, false),
                     pipeline.estimator().predicted_silhouette(observation, c, estimate)});
  }
  return views;
}

Image draw_overlay(const std::vector<OverlayView>& views, const std::string& caption, int enlargement,
                   const OverlayNames& names) {
  std::vector<cv::Mat> pictures;
  for (const auto& view : views) {
    cv::Mat picture;
    cv::resize(to_matrix(*view.image), picture, {}, enlargement, enlargement, cv::INTER_LINEAR);
    tint(picture, view.marked, enlargement);
    draw_outline(picture, view.nominal, enlargement, kRed);
    draw_outline(picture, view.corrected, enlargement, kGreen);
    if (view.part[2] > 0) {
      const cv::Rect part(view.part[0], view.part[1], view.part[2], view.part[3]);
      const cv::Rect whole(0, 0, view.image->width, view.image->height);
      const cv::Rect shown = part & whole;
      picture = picture(cv::Rect(shown.x * enlargement, shown.y * enlargement, shown.width * enlargement,
                                 shown.height * enlargement))
                    .clone();
    }
    pictures.push_back(picture);
  }
  cv::Mat row;
  cv::hconcat(pictures, row);
  const int bar_px = caption.empty() ? 0 : kCaptionHeight_px;
  cv::Mat page(row.rows + bar_px, row.cols, CV_8UC3, cv::Scalar(24, 24, 28));
  row.copyTo(page.rowRange(bar_px, page.rows));
  const auto write = [&](const std::string& text, int x, const cv::Scalar& colour) {
    cv::putText(page, text, {x, 18}, cv::FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv::LINE_AA);
    return x + cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 0.45, 1, nullptr).width + 16;
  };
  if (!caption.empty()) {
    int x = write(caption, 8, cv::Scalar(230, 230, 230));
    x = write(names.nominal, x, kRed);
    write(names.corrected, x, kGreen);
  }
  Image result(page.cols, page.rows, 3);
  std::copy(page.datastart, page.dataend, result.data.begin());
  return result;
}

void write_png(const std::filesystem::path& file, const Image& image) {
  cv::Mat bgr;
  cv::Mat rgb = to_matrix(image);
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> png;
  if (!cv::imencode(".png", bgr, png)) throw FileError(file.string() + ": this picture cannot be made a PNG");
  if (file.has_parent_path()) make_folder(file.parent_path());
  write_file(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace bodyschema
