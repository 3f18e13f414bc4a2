#include "netpbm.hpp"

#include <fstream>
#include <string>

#include "bodyschema/core/error.hpp"
#include "picture_file.hpp"

namespace bodyschema {

namespace {

/// The next number of the header, behind white space and comments; -1 when there is none.
int header_number(std::istream& in) {
  int c = in.get();
  while (c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '#') {
    if (c == '#') {
      while (c != '\n' && c != EOF) c = in.get();
    } else {
      c = in.get();
    }
  }
  if (c < '0' || c > '9') return -1;
  int number = 0;
  for (; c >= '0' && c <= '9'; c = in.get()) {
    number = number * 10 + (c - '0');
    if (number > 1'000'000) return -1;
  }
  return number;  // the one white space after it is consumed
}

}  // namespace

Image read_netpbm(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FileError(file.string() + ": picture cannot be opened");
  const int p = in.get();
  const int kind = in.get();
  if (p != 'P' || (kind != '5' && kind != '6')) {
    throw FileError(file.string() + ": not a binary PPM or PGM picture");
  }
  const int width = header_number(in);
  const int height = header_number(in);
  const int largest = header_number(in);
  if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px || largest != 255) {
    throw FileError(file.string() + ": header says " + std::to_string(width) + "x" + std::to_string(height) +
                    " with values up to " + std::to_string(largest) + "; expected 1 to " + std::to_string(kMaxSide_px) +
                    " px a side and 255");
  }
  const int channels = kind == '6' ? 3 : 1;
  const auto size =
      static_cast<std::uintmax_t>(width) * static_cast<std::uintmax_t>(height) * static_cast<std::uintmax_t>(channels);
  std::error_code error;
  const auto held = std::filesystem::file_size(file, error);
  const auto begin = in.tellg();
  if (error || begin < 0 || held < static_cast<std::uintmax_t>(begin) + size) {
    throw FileError(file.string() + ": is cut short; " + std::to_string(width) + "x" + std::to_string(height) +
                    " px take " + std::to_string(size) + " bytes");
  }
  Image image(width, height, channels);
  in.read(reinterpret_cast<char*>(image.data.data()), static_cast<std::streamsize>(size));
  if (!in) throw FileError(file.string() + ": cannot be read");
  return image;
}

}  // namespace bodyschema
