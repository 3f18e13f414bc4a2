#include "yarp_data_log.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>

#include "bodyschema/core/file_size.hpp"
#include "text_line.hpp"

namespace bodyschema {
namespace {

constexpr std::uintmax_t kMaxDataBytes = 256u << 20;  // rows are kept; an hour of an arm at 100 Hz has some 50 MB
constexpr std::uint64_t kMaxRows = 10 * 3600 * 200;   // ten hours at 200 Hz; rows take more than their text

Microseconds parse_stamp(const std::string& text, const std::string& where) {
  double stamp_s = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), stamp_s);
  const bool plausible = stamp_s >= 0.0 && stamp_s <= seconds(kLatestStamp);
  if (error != std::errc{} || end != text.data() + text.size() || !plausible) {
    throw FileError(where + ": '" + text + "' is not a time stamp in seconds");
  }
  return microseconds(stamp_s);
}

double parse_number(const std::string& text, const std::string& where) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw FileError(where + ": '" + text + "' is not a number");
  }
  if (!std::isfinite(value)) throw FileError(where + ": '" + text + "' is not a finite number");
  return value;
}

/// Whether two stamps stand before the values, sender's first: `Stamp: tx+rx;` in info.log.
bool says_two_stamps(const std::filesystem::path& folder) {
  std::ifstream info(folder / "info.log");
  std::string line;
  while (next_line(info, line) && line.size() <= kMaxLineBytes) {
    if (line.rfind("Stamp:", 0) == 0) {
      return line.find("tx") != std::string::npos && line.find("rx") != std::string::npos;
    }
  }
  return false;
}

std::optional<double> as_number(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Whether the word behind the sender's stamp can only be the receiver's: info.log does not say so when the
/// sender's was forced (--txTime) on messages that had none, which then is 0.
bool is_second_stamp(const std::string& first, const std::string& second) {
  constexpr double kNoReading = 1000.0;  // deg; a clock shows more
  const auto tx = as_number(first), rx = as_number(second);
  return tx && rx && *rx > kNoReading && (*tx == 0.0 || std::abs(*rx - *tx) < 60.0);
}

/// YARP writes lists in parentheses, which carry nothing here.
std::vector<std::string> split(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == '\r' || c == '\t'; }, ' ');
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(' ', at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// Folders of a recording that hold a data.log, for an error that names what is there.
std::string folders_of(const std::filesystem::path& recording) {
  constexpr int kDeepest = 5;
  constexpr std::size_t kMost = 12;
  std::vector<std::string> folders;
  std::error_code error;
  using Iterator = std::filesystem::recursive_directory_iterator;
  for (Iterator at(recording, error), end; !error && at != end && folders.size() <= kMost; at.increment(error)) {
    if (at.depth() >= kDeepest) at.disable_recursion_pending();
    if (at->path().filename() == "data.log") {
      folders.push_back(at->path().parent_path().lexically_relative(recording).generic_string());
    }
  }
  if (folders.empty()) return "no folder in it holds a data.log";
  std::sort(folders.begin(), folders.end());
  std::string text = "it holds ";
  for (std::size_t i = 0; i < std::min(folders.size(), kMost); ++i) text += (i > 0 ? ", " : "") + folders[i];
  return folders.size() > kMost ? text + " and more" : text;
}

}  // namespace

YarpDataLog::YarpDataLog(const std::filesystem::path& recording, const std::string& folder, const std::string& key,
                         const YarpImportOptions::Encoders* encoders)
    : file_(recording / folder / "data.log"), key_(key), encoders_(encoders) {
  if (!std::filesystem::is_directory(recording / folder)) {
    throw FileError((recording / folder).string() + ": no such folder in the recording (yarp_import." + key + "); " +
                    folders_of(recording));
  }
  two_stamps_ = says_two_stamps(recording / folder);
  std::ifstream in(file_);
  if (!in) throw FileError(file_.string() + ": cannot be opened");
  file_size_at_most(file_, kMaxDataBytes);
  if (encoders_ != nullptr) columns_ = usual_columns(in);
  std::string text;
  std::uint64_t lines = 0;
  for (std::uint64_t number = 1; next_line(in, text); ++number) {
    const bool too_long = text.size() > kMaxLineBytes;
    const auto words = split(std::move(text));
    if (words.empty()) continue;
    if (++lines > kMaxRows) {
      throw FileError(file_.string() + ": more than " + std::to_string(kMaxRows) +
                      " rows, ten hours at 200 Hz; cut it into parts");
    }
    try {
      if (too_long) {
        throw FileError(where(number) + ": line of more than " + std::to_string(kMaxLineBytes) + " bytes");
      }
      take(words, number);
    } catch (const FileError& error) {
      bad_.add(error);
    }
  }
  if (in.bad()) throw FileError(file_.string() + ": cannot be read");
  if (lines == 0) throw FileError(file_.string() + ": holds no data");
  bad_.check(lines, "lines");
}

/// All columns, or the fewest where most rows have just these. Leaves the file at its beginning.
std::size_t YarpDataLog::usual_columns(std::istream& in) const {
  const std::size_t all = encoders_->columns.size(), fewest = encoders_->fewest;
  if (fewest == all) return all;
  std::size_t whole = 0, few = 0;
  for (std::string text; next_line(in, text);) {
    const auto words = split(std::move(text));
    whole += stamps_before(words, all) > 0;
    few += stamps_before(words, fewest) > 0;
  }
  in.clear();
  in.seekg(0);
  return few > whole ? fewest : all;
}

/// How many stamps stand before that many values; 0: it is no such row.
std::size_t YarpDataLog::stamps_before(const std::vector<std::string>& words, std::size_t values) const {
  if (words.size() == 3 + values && (two_stamps_ || is_second_stamp(words[1], words[2]))) return 2;
  return words.size() == 2 + values && !two_stamps_ ? 1 : 0;
}

/// Whether the last line's stamp lies far beyond the one before it and the one that comes now: it would
/// put all further lines out of order.
bool YarpDataLog::stands_alone(Microseconds now) const {
  constexpr Microseconds kFar = 60'000'000;
  const auto n = lines_.size();
  return lines_.back().utime - now > kFar && (n < 2 || now > lines_[n - 2].utime);
}

void YarpDataLog::take(const std::vector<std::string>& words, std::uint64_t number) {
  if (words.size() < 3) throw FileError(where(number) + ": expected a counter, a time stamp and values");
  parse_number(words[0], where(number));
  YarpLine line;
  line.number = number;
  std::size_t stamps = 1;
  if (encoders_ == nullptr) {
    stamps = words.size() > 3 && as_number(words[2]) ? 2 : 1;
    line.picture = words[1 + stamps];
  } else {
    stamps = stamps_before(words, columns_);
    if (stamps == 0) {
      (void)parse_stamp(words[1], where(number));
      throw FileError(where(number) + ": has " + std::to_string(words.size() - (two_stamps_ ? 3 : 2)) +
                      " values, expected " + std::to_string(columns_) + " (yarp_import." + key_ + ")");
    }
    for (std::size_t i = 1 + stamps; i < words.size(); ++i) {
      line.values.push_back(parse_number(words[i], where(number)));
    }
  }
  line.utime = parse_stamp(words[1], where(number));
  if (stamps == 2 && line.utime == 0) line.utime = parse_stamp(words[2], where(number));
  if (!lines_.empty() && line.utime <= lines_.back().utime && stands_alone(line.utime)) {
    bad_.add(FileError(where(lines_.back().number) + ": the stamp is far after those around it"));
    lines_.pop_back();
  }
  if (!lines_.empty() && line.utime <= lines_.back().utime) {
    if (out_of_order_++ == 0) {
      spdlog::warn("{}: stamp is not after the one before; such rows are left out", where(number));
    }
    return;
  }
  lines_.push_back(std::move(line));
}

}  // namespace bodyschema
