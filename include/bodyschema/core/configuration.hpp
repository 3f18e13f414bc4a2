#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bodyschema {

/// A strict view of one YAML document: a mapping whose every key must be known to some reader.
///
/// A document may begin with `include: [file, ...]` (paths relative to the including file, or to the
/// installed data, as `config/estimator.yaml`); later files and the including file itself override
/// earlier ones, mapping by mapping. `${NAME}` and
/// `${NAME:-default}` in a string are replaced by environment variables. `overrides` are
/// `dotted.key=value` pairs, as given by `--set` on the command line.
///
/// Every getter marks its key as known and remembers the value in force, for `--print-config`.
/// After all readers are done, `reject_unknown_keys()` throws for any key nobody asked for and
/// names the nearest valid one. A value of the wrong type or outside its range throws
/// ConfigurationError naming file, key, value and what was expected. Keys are taken whole: as names of
/// joints they may hold dots; of the keys that a document has, `overrides` mean the longest.
///
/// Copies share one document. Not thread-safe; configurations are read at start-up.
class Configuration {
 public:
  /// The layout of configuration files this software reads; a file may state its own as `version`.
  static constexpr std::int64_t kVersion = 1;

  /// Throws ConfigurationError when the file is missing, is not YAML, or includes itself.
  static Configuration load(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});
  /// For tests: a document given as text; relative paths resolve against `directory`.
  static Configuration parse(std::string_view yaml, const std::filesystem::path& directory = ".");

  /// The mapping under `key`; an absent key is an empty mapping (all defaults).
  [[nodiscard]] Configuration section(const std::string& key) const;
  [[nodiscard]] bool has(const std::string& key) const;
  /// Whether the value is a mapping, for keys that may also hold a list or a word.
  [[nodiscard]] bool is_mapping(const std::string& key) const;
  /// The same of a list.
  [[nodiscard]] bool is_list(const std::string& key) const;
  /// Keys of this mapping in document order; marks them all as known (for maps keyed by joint).
  [[nodiscard]] std::vector<std::string> keys() const;

  /// Required values.
  [[nodiscard]] double number(const std::string& key, double min = -kInf, double max = kInf) const;
  [[nodiscard]] std::int64_t integer(const std::string& key, std::int64_t min, std::int64_t max) const;
  [[nodiscard]] bool boolean(const std::string& key) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  /// One of `choices`; the error lists them.
  [[nodiscard]] std::string choice(const std::string& key, const std::vector<std::string>& choices) const;
  [[nodiscard]] std::vector<double> numbers(const std::string& key) const;
  /// A table, given as a list of equally long lists.
  [[nodiscard]] std::vector<std::vector<double>> rows(const std::string& key) const;
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  /// A path; relative ones resolve against the file that holds the key.
  [[nodiscard]] std::filesystem::path path(const std::string& key) const;
  [[nodiscard]] std::vector<std::filesystem::path> paths(const std::string& key) const;

  /// The same with a value for an absent key.
  [[nodiscard]] double number_or(const std::string& key, double fallback, double min = -kInf, double max = kInf) const;
  [[nodiscard]] std::int64_t integer_or(const std::string& key, std::int64_t fallback, std::int64_t min,
                                        std::int64_t max) const;
  [[nodiscard]] bool boolean_or(const std::string& key, bool fallback) const;
  [[nodiscard]] std::string text_or(const std::string& key, const std::string& fallback) const;
  [[nodiscard]] std::string choice_or(const std::string& key, const std::string& fallback,
                                      const std::vector<std::string>& choices) const;
  [[nodiscard]] std::vector<double> numbers_or(const std::string& key, const std::vector<double>& fallback) const;
  [[nodiscard]] std::vector<std::string> texts_or(const std::string& key,
                                                  const std::vector<std::string>& fallback) const;

  /// Throws for the first key of this mapping, and of those below it, that no getter asked for, e.g.
  /// "config/a.yaml:12: unknown key 'filter.particle'; did you mean 'filter.particles'?".
  void reject_unknown_keys() const;
  /// What another program reads and checks: reject_unknown_keys lets it pass.
  void leave_to_others(const std::string& key) const;
  /// For programs that read some sections only: throws for the first key at the top of the document that is
  /// no section of any program, e.g. "--set buss.channel_prefix=LAB: unknown key 'buss'; did you mean 'bus'?".
  void reject_unknown_sections() const;
  /// The whole document with includes, overrides and defaults in force, as YAML.
  [[nodiscard]] std::string print() const;
  /// A short hexadecimal digest of print(), published so that a result names its configuration.
  [[nodiscard]] std::string hash() const;
  /// "config/a.yaml:12: key 'filter.particles'", for errors found later, when the values are used.
  [[nodiscard]] std::string place(const std::string& key) const;
  /// An error about `key` of this section in this class's wording, for checks made by readers.
  [[noreturn]] void fail(const std::string& key, const std::string& expected) const;

 private:
  static constexpr double kInf = std::numeric_limits<double>::infinity();
  struct Document;
  Configuration(std::shared_ptr<Document> document, std::vector<std::string> section);
  void check_version() const;
  std::shared_ptr<Document> document_;
  std::vector<std::string> section_;  ///< names from the top
};

}  // namespace bodyschema
