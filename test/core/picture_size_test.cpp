#include "bodyschema/core/picture_size.hpp"

#include <gtest/gtest.h>

#include <string>

namespace bodyschema {
namespace {

std::optional<PictureSize> size_of(const std::string& file) {
  return picture_size({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()});
}

using namespace std::string_literals;

TEST(PictureSize, IsReadFromTheHeader) {
  const std::string png = "\x89PNG\r\n\x1A\n\0\0\0\rIHDR\0\0\x75\x30\0\0\0\x05"s;
  EXPECT_EQ(size_of(png), (PictureSize{30'000, 5}));
  EXPECT_EQ(size_of("\x89PNG\r\n\x1A\n\0\0\0\rIHDR\xFF\xFF\xFF\xFF\0\0\0\1"s), (PictureSize{1'000'000'000, 1}));
  const std::string jpeg = "\xFF\xD8\xFF\xE0\0\x04xx\xFF\xFF\xC4\0\x02\xFF\xC2\0\x0B\x08\0\xF0\x01\x40\x01\0\0\0"s;
  EXPECT_EQ(size_of(jpeg), (PictureSize{320, 240}));
  EXPECT_EQ(size_of("P6\n# by 12\r\n320\t240 255\n"), (PictureSize{320, 240}));
  EXPECT_EQ(size_of("P2 99999999999999999999 1 1"), (PictureSize{1'000'000'000, 1}));
}

TEST(PictureSize, IsNoneWhereThereIsNone) {
  for (const std::string& file : {""s, "P"s, "P7\n1 1"s, "BM\0\0\0\0\0\0"s, "\x89PNG\r\n\x1A"s}) {
    EXPECT_EQ(size_of(file), std::nullopt) << file;
  }
  for (const std::string& file :
       {"P6\n#"s, "P5 x"s, "\xFF\xD8\xFF\xE0\xFF\xFF"s, "\xFF\xD8xxxxxxxxxxxx"s, "\x89PNG\r\n\x1A\n"s}) {
    EXPECT_EQ(size_of(file), (PictureSize{0, 0})) << file;
  }
}

}  // namespace
}  // namespace bodyschema
