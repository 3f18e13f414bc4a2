#pragma once

#include <cstddef>
#include <istream>
#include <string>

namespace bodyschema {

/// A longer line of a recording's text files is an error of the file, not a value.
inline constexpr std::size_t kMaxLineBytes = 1 << 16;

/// The next line without its end, "\n" or "\r\n"; of one that is too long, enough to see that it is.
inline bool next_line(std::istream& in, std::string& line) {
  line.clear();
  bool any = false;
  for (int c = 0; (c = in.get()) != std::char_traits<char>::eof();) {
    any = true;
    if (c == '\n') break;
    if (line.size() <= kMaxLineBytes) line += static_cast<char>(c);
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return any;
}

}  // namespace bodyschema
