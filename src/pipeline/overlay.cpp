#include "bodyschema/pipeline/overlay.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {
namespace {

const cv::Scalar kRed(255, 60, 60);
const cv::Scalar kGreen(60, 230, 90);
constexpr int kPage_px = 1300;
/// A phone shows a page about so wide; what shall be seen on it is measured in its pixels.
constexpr double kPhone_px = 420.0;

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

/// Edge of the mask, as wide on the page as one pixel of a phone.
void draw_outline(cv::Mat& picture, const BinaryMask& mask, int enlargement, int width_px, const cv::Scalar& colour) {
  if (mask.empty()) return;
  cv::Mat bits(mask.height(), mask.width(), CV_8UC1);
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) bits.at<std::uint8_t>(v, u) = mask.at(u, v) ? 255 : 0;
  }
  cv::Mat large;
  cv::resize(bits, large, {}, enlargement, enlargement, cv::INTER_NEAREST);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(large, outlines, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  cv::drawContours(picture, outlines, -1, colour, width_px, cv::LINE_AA);
}

cv::Rect shown_part(const OverlayView& view) {
  const cv::Rect whole(0, 0, view.image->width, view.image->height);
  return view.part[2] > 0 ? cv::Rect(view.part[0], view.part[1], view.part[2], view.part[3]) & whole : whole;
}

/// What both outlines lie in; empty where there are none.
cv::Rect arm_in(const OverlayView& view) {
  cv::Rect arm;
  for (const BinaryMask* mask : {&view.nominal, &view.corrected}) {
    if (const PixelBox box = bounding_box(*mask); !box.empty()) arm |= {box.u0, box.v0, box.width(), box.height()};
  }
  return arm;
}

/// Text and lines of a page, in sizes of a phone's pixels.
class Pen {
 public:
  explicit Pen(int page_px) : per_phone_px_(page_px / kPhone_px) {}
  [[nodiscard]] int px(double of_phone) const { return std::max(1, cvRound(of_phone * per_phone_px_)); }
  [[nodiscard]] int width_of(const std::string& text) const {
    return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale(), 1, nullptr).width;
  }
  void write(cv::Mat& page, const std::string& text, cv::Point at, const cv::Scalar& colour) const {
    cv::putText(page, text, at, cv::FONT_HERSHEY_SIMPLEX, scale(), colour, px(1.0), cv::LINE_AA);
  }

 private:
  static constexpr double kLetter_px = 9.0;                                         ///< height of a capital letter
  [[nodiscard]] double scale() const { return kLetter_px * per_phone_px_ / 21.0; }  // of that font at scale 1
  double per_phone_px_;
};

/// A bar of a round length in the lower right corner.
void draw_scale_bar(cv::Mat& picture, const Pen& pen, double px_per_m) {
  if (!(px_per_m > 0.0)) return;
  double length_m = 0.0;
  for (const double candidate : {0.01, 0.02, 0.05, 0.1, 0.2, 0.5}) {
    if (candidate * px_per_m < 0.4 * picture.cols) length_m = candidate;
  }
  if (length_m == 0.0) return;
  const std::string text = std::to_string(cvRound(100.0 * length_m)) + " cm";
  const cv::Scalar white(255, 255, 255), dark(24, 24, 28);
  const int margin = pen.px(8.0), bar = cvRound(length_m * px_per_m), letters = pen.width_of(text);
  const int right = picture.cols - margin, bottom = picture.rows - margin;
  const cv::Rect behind(right - std::max(bar, letters) - margin, bottom - pen.px(18.0),
                        std::max(bar, letters) + 2 * margin, pen.px(26.0));
  cv::rectangle(picture, behind & cv::Rect(0, 0, picture.cols, picture.rows), dark, cv::FILLED);
  cv::line(picture, {right - bar, bottom}, {right, bottom}, white, pen.px(2.0));
  pen.write(picture, text, {right - letters, bottom - pen.px(5.0)}, white);
}

/// Caption and legend, on one line or on two.
cv::Mat header(int width_px, const Pen& pen, const std::string& caption, const OverlayNames& names) {
  const int line = pen.px(17.0), margin = pen.px(5.0), gap = pen.px(10.0);
  const int legend_px = pen.width_of(names.nominal) + gap + pen.width_of(names.corrected);
  const bool one_line = margin + pen.width_of(caption) + gap + legend_px < width_px;
  cv::Mat bar((one_line ? 1 : 2) * line + margin, width_px, CV_8UC3, cv::Scalar(24, 24, 28));
  pen.write(bar, caption, {margin, line - margin / 2}, cv::Scalar(230, 230, 230));
  int x = one_line ? margin + pen.width_of(caption) + gap : margin;
  const int y = (one_line ? line : 2 * line) - margin / 2;
  pen.write(bar, names.nominal, {x, y}, kRed);
  x += pen.width_of(names.nominal) + gap;
  pen.write(bar, names.corrected, {x, y}, kGreen);
  return bar;
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
  Estimator& estimator = pipeline.estimator();
  for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
    if (!observation.cameras[c]) continue;
    const auto& seen = *observation.cameras[c];
    views.push_back({&seen.image, estimator.predicted_silhouette(observation, c, false),
                     estimator.predicted_silhouette(observation, c, estimate)});
    const double depth_m = estimator.hand_pose(estimator.at_rest(seen.joints.q, c), estimate).translation().z();
    if (depth_m > 0.0) views.back().px_per_m = pipeline.rig().cameras[c].intrinsics.fx / depth_m;
  }
  return views;
}

void crop_to_arm(std::vector<OverlayView>& views) {
  constexpr double kMargin = 0.12;  // of the arm's larger side
  cv::Size size;
  std::vector<cv::Rect> arms;
  for (const auto& view : views) {
    cv::Rect arm = arm_in(view);
    if (arm.empty()) arm = {0, 0, view.image->width, view.image->height};
    const int margin = cvRound(kMargin * std::max(arm.width, arm.height));
    arms.emplace_back(arm.x - margin, arm.y - margin, arm.width + 2 * margin, arm.height + 2 * margin);
    size = {std::max(size.width, arms.back().width), std::max(size.height, arms.back().height)};
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Image& image = *views[i].image;
    const int width = std::min(size.width, image.width), height = std::min(size.height, image.height);
    const int x = arms[i].x + (arms[i].width - width) / 2, y = arms[i].y + (arms[i].height - height) / 2;
    views[i].part = {std::clamp(x, 0, image.width - width), std::clamp(y, 0, image.height - height), width, height};
  }
}

Image draw_overlay(const std::vector<OverlayView>& views, const std::string& caption, int enlargement,
                   const OverlayNames& names) {
  int width_px = 0;
  for (const auto& view : views) width_px += shown_part(view).width;
  if (enlargement <= 0) enlargement = std::clamp(cvRound(static_cast<double>(kPage_px) / std::max(1, width_px)), 1, 8);
  const Pen pen(width_px * enlargement);
  std::vector<cv::Mat> pictures;
  for (const auto& view : views) {
    cv::Mat picture;
    cv::resize(to_matrix(*view.image), picture, {}, enlargement, enlargement, cv::INTER_LINEAR);
    tint(picture, view.marked, enlargement);
    draw_outline(picture, view.nominal, enlargement, pen.px(1.0), kRed);
    draw_outline(picture, view.corrected, enlargement, pen.px(1.0), kGreen);
    const cv::Rect shown = shown_part(view);
    picture = picture(cv::Rect(shown.tl() * enlargement, shown.size() * enlargement)).clone();
    if (!caption.empty()) draw_scale_bar(picture, pen, view.px_per_m * enlargement);
    pictures.push_back(picture);
  }
  int rows = 0;
  for (const auto& picture : pictures) rows = std::max(rows, picture.rows);
  for (auto& picture : pictures) {  // cameras may differ in size
    cv::copyMakeBorder(picture, picture, 0, rows - picture.rows, 0, 0, cv::BORDER_CONSTANT);
  }
  cv::Mat page;
  cv::hconcat(pictures, page);
  if (!caption.empty()) cv::vconcat(header(page.cols, pen, caption, names), page, page);
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
