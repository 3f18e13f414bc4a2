#include "bodyschema/imports/csv_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <set>

#include "bodyschema/core/file_size.hpp"
#include "text_line.hpp"

namespace bodyschema {
namespace {

constexpr std::uintmax_t kMaxTableBytes = 256u << 20;
constexpr std::size_t kMaxColumns = 4096;
constexpr std::size_t kMaxValues = 32u << 20;  // of all rows: 256 MiB

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::vector<std::string> fields_of(const std::string& line, char separator) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == separator && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  for (std::string& field : fields) field = trimmed(field);
  return fields;
}

bool read_number(const std::string& text, double& value) {
  const char* begin = text.data() + (!text.empty() && text.front() == '+' ? 1 : 0);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  return error == std::errc{} && stop == end && std::isfinite(value);
}

/// Spreadsheets write separators for columns that hold nothing.
void drop_empty_end(std::vector<std::string>& fields, std::size_t wanted) {
  while (fields.size() > wanted && fields.back().empty()) fields.pop_back();
}

bool are_empty(const std::vector<std::string>& fields) {
  return std::all_of(fields.begin(), fields.end(), [](const std::string& field) { return field.empty(); });
}

}  // namespace

FileError CsvTable::not_a_number(const Row& row, std::size_t column) const {
  return FileError(where(row) + ": '" + row.words.at(column) + "' in column '" + names[column] +
                   "' is not a finite number");
}

std::size_t CsvTable::find(std::initializer_list<const char*> wanted) const {
  for (const char* name : wanted) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at != names.end()) return static_cast<std::size_t>(at - names.begin());
  }
  return kNone;
}

CsvTable CsvTable::read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || !std::filesystem::is_regular_file(file)) throw FileError(file.string() + ": no such file");
  file_size_at_most(file, kMaxTableBytes);
  CsvTable table;
  table.file = file;
  std::string line;
  std::uint64_t number = 0;
  while (next_line(in, line)) {
    ++number;
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);  // as some editors begin a file
    if (!trimmed(line).empty()) break;
  }
  char separator = ',';
  for (const char other : {';', '\t'}) {
    if (line.find(',') == std::string::npos && line.find(other) != std::string::npos) separator = other;
  }
  table.names = fields_of(line, separator);
  drop_empty_end(table.names, 1);
  const std::string first = file.string() + ":" + std::to_string(std::max<std::uint64_t>(number, 1));
  if (line.size() > kMaxLineBytes || table.names.size() > kMaxColumns) {
    throw FileError(first + ": too many columns; expected a line of names, at most " + std::to_string(kMaxColumns));
  }
  std::set<std::string> seen;
  for (const std::string& name : table.names) {
    double value = 0.0;
    if (name.empty() || read_number(name, value)) {
      throw FileError(first + ": '" + name + "' is no name; expected a line of column names above the numbers");
    }
    if (!seen.insert(name).second) throw FileError(first + ": column '" + name + "' is there twice");
  }
  std::size_t values = 0;
  while (next_line(in, line)) {
    ++number;
    if (trimmed(line).empty()) continue;
    Row row;
    row.line = number;
    row.place = table.rows.size() + table.bad.count;
    const std::string where = file.string() + ":" + std::to_string(number);
    auto fields = line.size() > kMaxLineBytes ? std::vector<std::string>() : fields_of(line, separator);
    if (!fields.empty() && are_empty(fields)) continue;
    drop_empty_end(fields, table.names.size());
    if (fields.size() != table.names.size()) {
      table.bad.add(FileError(where + ": " + std::to_string(fields.size()) + " values, expected " +
                              std::to_string(table.names.size())));
      continue;
    }
    for (std::size_t c = 0; c < fields.size(); ++c) {
      double value = std::numeric_limits<double>::quiet_NaN();
      if (!fields[c].empty() && !read_number(fields[c], value)) {
        value = std::numeric_limits<double>::quiet_NaN();  // it may have begun as one
        row.words[c] = fields[c];
      }
      row.values.push_back(value);
    }
    values += fields.size();
    if (values > kMaxValues) throw FileError(where + ": too many rows for one recording; cut it into parts");
    table.rows.push_back(std::move(row));
  }
  if (in.bad()) throw FileError(file.string() + ": cannot be read");
  table.bad.check(table.rows.size() + table.bad.count, "rows");
  if (table.rows.empty()) throw FileError(file.string() + ": holds no rows of numbers");
  return table;
}

}  // namespace bodyschema
