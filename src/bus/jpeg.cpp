#include "jpeg.hpp"

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>
// Behind jpeglib.h, which it needs.
#include <jerror.h>

#include "bodyschema/core/error.hpp"

namespace bodyschema {

namespace {

/// Scans of a progressive file beyond which it is an attack on our time.
constexpr int kMaxScans = 32;

/// libjpeg reports by calling these; it must not return from `fail`, so it jumps. Functions that
/// set the jump hold no objects with destructors.
struct Reporter {
  jpeg_error_mgr base;
  std::jmp_buf escape;
  bool doubtful = false;
  char text[JMSG_LENGTH_MAX] = {};

  static Reporter& of(j_common_ptr jpeg) { return *reinterpret_cast<Reporter*>(jpeg->err); }

  [[noreturn]] static void fail(j_common_ptr jpeg) {
    jpeg->err->format_message(jpeg, of(jpeg).text);
    std::longjmp(of(jpeg).escape, 1);
  }
  static void message(j_common_ptr jpeg, int level) {
    // Some cameras pad between segments: unusual, harmless.
    if (level >= 0 || jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA) return;
    if (!of(jpeg).doubtful) jpeg->err->format_message(jpeg, of(jpeg).text);
    of(jpeg).doubtful = true;
  }
  static void output(j_common_ptr) {}
  static void count_scans(j_common_ptr jpeg) {
    if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > kMaxScans) {
      std::snprintf(of(jpeg).text, sizeof of(jpeg).text, "more than %d scans", kMaxScans);
      std::longjmp(of(jpeg).escape, 1);
    }
  }

  jpeg_error_mgr* install() {
    jpeg_std_error(&base);
    base.error_exit = fail;
    base.emit_message = message;
    base.output_message = output;
    return &base;
  }
};

enum class Step { kDone, kWrongSize, kBroken };

/// Reads the header: size and whether the picture is gray.
Step read_header(jpeg_decompress_struct& jpeg, Reporter& reporter, Bytes file, int width, int height) {
  if (setjmp(reporter.escape) != 0) return Step::kBroken;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, file.data(), static_cast<unsigned long>(file.size()));
  jpeg_read_header(&jpeg, TRUE);
  if (static_cast<int>(jpeg.image_width) != width || static_cast<int>(jpeg.image_height) != height) {
    return Step::kWrongSize;
  }
  jpeg.out_color_space = jpeg.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE : JCS_RGB;
  return Step::kDone;
}

Step read_pixels(jpeg_decompress_struct& jpeg, Reporter& reporter, jpeg_progress_mgr& progress, std::uint8_t* pixels,
                 std::size_t row_bytes) {
  if (setjmp(reporter.escape) != 0) return Step::kBroken;
  progress.progress_monitor = Reporter::count_scans;
  jpeg.progress = &progress;
  jpeg_start_decompress(&jpeg);
  while (jpeg.output_scanline < jpeg.output_height && !reporter.doubtful) {
    JSAMPROW row = pixels + jpeg.output_scanline * row_bytes;
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  if (reporter.doubtful) return Step::kBroken;
  jpeg_finish_decompress(&jpeg);
  return reporter.doubtful ? Step::kBroken : Step::kDone;
}

bool write_pixels(jpeg_compress_struct& jpeg, Reporter& reporter, const Image& image, int quality, unsigned char*& file,
                  unsigned long& size) {
  if (setjmp(reporter.escape) != 0) return false;
  jpeg_create_compress(&jpeg);
  jpeg_mem_dest(&jpeg, &file, &size);
  jpeg.image_width = static_cast<JDIMENSION>(image.width);
  jpeg.image_height = static_cast<JDIMENSION>(image.height);
  jpeg.input_components = image.channels;
  jpeg.in_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    auto* row = const_cast<JSAMPLE*>(image.pixel(0, static_cast<int>(jpeg.next_scanline)));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

}  // namespace

DecodeResult decompress_jpeg(Bytes file, int width, int height, int reduction, Image& out) {
  if (file.empty()) return {MessageFault::kBrokenPicture, "JPEG of no bytes"};
  jpeg_decompress_struct jpeg{};
  jpeg_progress_mgr progress{};
  Reporter reporter{};
  jpeg.err = reporter.install();
  Step step = read_header(jpeg, reporter, file, width, height);
  if (step == Step::kDone) {
    jpeg.scale_num = 1;
    jpeg.scale_denom = static_cast<unsigned>(reduction);
    out.width = width / reduction;
    out.height = height / reduction;
    out.channels = jpeg.out_color_space == JCS_GRAYSCALE ? 1 : 3;
    const auto row_bytes = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.channels);
    out.data.resize(row_bytes * static_cast<std::size_t>(out.height));
    step = read_pixels(jpeg, reporter, progress, out.data.data(), row_bytes);
  }
  DecodeResult result;
  if (step == Step::kWrongSize) {
    result = {MessageFault::kWrongSize, "JPEG of " + std::to_string(jpeg.image_width) + "x" +
                                            std::to_string(jpeg.image_height) + " in a message that says " +
                                            std::to_string(width) + "x" + std::to_string(height)};
  } else if (step == Step::kBroken) {
    result = {MessageFault::kBrokenPicture, std::string("JPEG does not decode: ") + reporter.text};
  }
  jpeg_destroy_decompress(&jpeg);
  return result;
}

std::vector<std::uint8_t> compress_jpeg(const Image& image, int quality) {
  if (image.empty() || (image.channels != 1 && image.channels != 3)) {
    throw DataError("a picture of " + std::to_string(image.width) + "x" + std::to_string(image.height) + " with " +
                    std::to_string(image.channels) + " channels cannot be compressed");
  }
  jpeg_compress_struct jpeg{};
  Reporter reporter{};
  jpeg.err = reporter.install();
  unsigned char* file = nullptr;
  unsigned long size = 0;
  const bool done = write_pixels(jpeg, reporter, image, std::clamp(quality, 1, 100), file, size);
  jpeg_destroy_compress(&jpeg);
  std::vector<std::uint8_t> bytes;
  if (done) bytes.assign(file, file + size);
  std::free(file);
  if (!done) throw DataError(std::string("picture cannot be compressed: ") + reporter.text);
  return bytes;
}

}  // namespace bodyschema
