#include "bodyschema/core/configuration.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "bodyschema/core/digest.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/nearest_name.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFileBytes = 1 << 20;
constexpr std::size_t kMaxEntries = 20000;  // bounds documents that multiply themselves by aliases
constexpr int kMaxDepth = 32;

/// Those of all programs; a file may hold them beside its version.
constexpr std::array kSections = {"robot",  "cameras",    "vision",    "bus",    "estimator",
                                  "filter", "silhouette", "simulator", "import", "yarp_import"};

}  // namespace

/// A YAML value. Assignment rebinds: YAML::Node's own writes through to every copy of the node.
struct Leaf : YAML::Node {
  Leaf() = default;
  Leaf(const YAML::Node& node) : YAML::Node(node) {}
  Leaf(const Leaf&) = default;
  Leaf& operator=(const Leaf& other) {
    reset(other);
    return *this;
  }
};

/// One node of the merged document. Lists are leaves.
struct Entry {
  bool mapping = false;
  bool known = false;  ///< some reader asked for it
  struct Child;
  std::vector<Child> children;
  Leaf leaf;
  fs::path file;
  int line = 0;

  Entry* find(const std::string& key);
};

struct Entry::Child {
  std::string name;
  Entry entry;
};

Entry* Entry::find(const std::string& key) {
  for (auto& [name, child] : children) {
    if (name == key) return &child;
  }
  return nullptr;
}

namespace {

std::string where(const Entry& entry) {
  if (entry.file.empty()) return "configuration";
  return entry.line > 0 ? entry.file.string() + ":" + std::to_string(entry.line) : entry.file.string();
}

std::string shown(const Entry& entry) {
  if (entry.mapping) return "a mapping";
  if (!entry.leaf.IsDefined() || entry.leaf.IsNull()) return "empty";
  if (entry.leaf.IsScalar()) return "'" + entry.leaf.Scalar() + "'";
  return "a list";
}

std::string substitute_environment(const std::string& text, const std::string& place) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (text.compare(i, 2, "${") != 0) {
      out += text[i++];
      continue;
    }
    const std::size_t end = text.find('}', i);
    if (end == std::string::npos) {
      throw ConfigurationError(place + ": '" + text + "' has '${' without '}'");
    }
    const std::string body = text.substr(i + 2, end - i - 2);
    const std::size_t dash = body.find(":-");
    const std::string name = body.substr(0, dash);
    const char* value = std::getenv(name.c_str());
    if (value != nullptr && *value != '\0') {
      out += value;
    } else if (dash != std::string::npos) {
      out += body.substr(dash + 2);
    } else {
      throw ConfigurationError(place + ": environment variable " + name + " is not set and '" + text +
                               "' gives no default (${" + name + ":-default})");
    }
    i = end + 1;
  }
  return out;
}

void merge_into(Entry& base, Entry&& top) {
  if (!base.mapping || !top.mapping) {
    base = std::move(top);
    return;
  }
  for (auto& [name, child] : top.children) {
    if (Entry* existing = base.find(name)) {
      merge_into(*existing, std::move(child));
    } else {
      base.children.push_back({name, std::move(child)});
    }
  }
}

/// Beside the including file, or one that is installed: `config/estimator.yaml` from anywhere.
fs::path included(const fs::path& path, const fs::path& directory) {
  if (path.is_absolute()) return path;
  std::error_code ignored;
  const fs::path beside = directory / path;
  if (fs::exists(beside, ignored)) return beside;
  const fs::path installed = data_directory() / path;
  return fs::exists(installed, ignored) ? installed : beside;
}

class Reader {
 public:
  Entry read_file(const fs::path& file) {
    std::error_code error;
    const fs::path canonical = fs::weakly_canonical(file, error);
    if (std::find(open_.begin(), open_.end(), canonical) != open_.end()) {
      throw ConfigurationError(file.string() + ": includes itself");
    }
    if (!fs::is_regular_file(file, error)) {
      throw ConfigurationError(file.string() + ": no such configuration file");
    }
    if (fs::file_size(file, error) > kMaxFileBytes) {
      throw ConfigurationError(file.string() + ": larger than 1 MiB; expected a configuration file");
    }
    std::ifstream stream(file);
    std::stringstream text;
    text << stream.rdbuf();
    if (!stream) throw ConfigurationError(file.string() + ": cannot be read");
    open_.push_back(canonical);
    Entry entry = read_text(text.str(), file);
    open_.pop_back();
    return entry;
  }

  Entry read_text(const std::string& text, const fs::path& file) {
    YAML::Node root;
    try {
      root = YAML::Load(text);
    } catch (const YAML::Exception& e) {
      throw ConfigurationError(file.string() + ":" + std::to_string(e.mark.line + 1) + ": not valid YAML: " + e.msg);
    }
    Entry own;
    own.mapping = true;
    own.file = file;
    if (root.IsNull() || !root.IsDefined()) return own;
    if (!root.IsMap()) {
      throw ConfigurationError(file.string() + ": expected a mapping of keys at the top level");
    }
    Entry merged;
    merged.mapping = true;
    merged.file = file;
    own = convert(root, file, 0);
    check_version(own);
    for (auto it = own.children.begin(); it != own.children.end(); ++it) {
      if (it->name != "include") continue;
      Entry include = std::move(it->entry);
      own.children.erase(it);
      std::vector<std::string> names;
      if (!include.mapping && include.leaf.IsScalar()) {
        names.push_back(include.leaf.Scalar());
      } else if (!include.mapping && include.leaf.IsSequence()) {
        for (const auto& item : include.leaf) {
          if (item.IsScalar()) names.push_back(item.Scalar());
        }
      }
      if (names.empty()) {
        throw ConfigurationError(where(include) + ": key 'include' is " + shown(include) +
                                 "; expected a file or a list of files");
      }
      for (const auto& name : names) {
        const fs::path path = substitute_environment(name, where(include));
        merge_into(merged, read_file(included(path, file.parent_path())));
      }
      break;
    }
    merge_into(merged, std::move(own));
    return merged;
  }

  Entry convert(const YAML::Node& node, const fs::path& file, int depth) {
    if (++entries_ > kMaxEntries || depth > kMaxDepth) {
      throw ConfigurationError(file.string() + ": too many or too deeply nested entries");
    }
    Entry entry;
    entry.file = file;
    entry.line = node.Mark().line + 1;
    if (!node.IsMap()) {
      if (node.IsSequence()) count_items(node, file, depth + 1);
      entry.leaf = Leaf(node);
      return entry;
    }
    entry.mapping = true;
    for (const auto& pair : node) {
      if (!pair.first.IsScalar()) {
        throw ConfigurationError(file.string() + ":" + std::to_string(pair.first.Mark().line + 1) +
                                 ": a key that is not a word");
      }
      const std::string key = pair.first.Scalar();
      if (entry.find(key) != nullptr) {
        throw ConfigurationError(file.string() + ":" + std::to_string(pair.first.Mark().line + 1) + ": key '" + key +
                                 "' is given twice");
      }
      Entry child = convert(pair.second, file, depth + 1);
      child.line = pair.first.Mark().line + 1;
      entry.children.push_back({key, std::move(child)});
    }
    return entry;
  }

 private:
  /// Of every file by itself: the one that includes it has a version of its own.
  static void check_version(Entry& file) {
    const Entry* version = file.find("version");
    if (version == nullptr || (!version->mapping && version->leaf.IsScalar() &&
                               version->leaf.Scalar() == std::to_string(Configuration::kVersion))) {
      return;
    }
    throw ConfigurationError(where(*version) + ": key 'version' is " + shown(*version) + "; expected " +
                             std::to_string(Configuration::kVersion));
  }

  void count_items(const YAML::Node& node, const fs::path& file, int depth) {
    for (const auto& item : node) {
      if (++entries_ > kMaxEntries || depth > kMaxDepth) {
        throw ConfigurationError(file.string() + ": too many or too deeply nested entries");
      }
      // Of a mapping, an item is a pair and no node by itself.
      const YAML::Node& value = node.IsMap() ? item.second : item;
      if (value.IsSequence() || value.IsMap()) count_items(value, file, depth + 1);
    }
  }

  std::vector<fs::path> open_;
  std::size_t entries_ = 0;
};

void emit(YAML::Emitter& out, const Entry& entry) {
  if (!entry.mapping) {
    if (entry.leaf.IsDefined() && entry.leaf.IsSequence()) {
      out << YAML::Flow << static_cast<const YAML::Node&>(entry.leaf);
    } else {
      out << static_cast<const YAML::Node&>(entry.leaf);
    }
    return;
  }
  out << YAML::BeginMap;
  for (const auto& [name, child] : entry.children) {
    if (child.mapping && child.children.empty()) continue;
    out << YAML::Key << name << YAML::Value;
    emit(out, child);
  }
  out << YAML::EndMap;
}

void reject_unknown(const Entry& mapping, const std::string& prefix) {
  for (const auto& [name, child] : mapping.children) {
    if (!child.known) {
      std::vector<std::string> valid;
      for (const auto& [other, sibling] : mapping.children) {
        if (sibling.known) valid.push_back(other);
      }
      const std::string nearest = nearest_name(name, valid);
      throw ConfigurationError(where(child) + ": unknown key '" + prefix + name + "'" +
                               (nearest.empty() ? "" : "; did you mean '" + prefix + nearest + "'?"));
    }
    if (child.mapping) reject_unknown(child, prefix + name + ".");
  }
}

std::string range_text(const std::string& kind, double min, double max) {
  const auto show = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return std::string(text);
  };
  if (std::isinf(min) && std::isinf(max)) return kind;
  if (min == max) return show(min);
  if (std::isinf(max)) return kind + " of at least " + show(min);
  if (std::isinf(min)) return kind + " of at most " + show(max);
  return kind + " from " + show(min) + " to " + show(max);
}

std::optional<double> parse_number(const std::string& text) {
  double value = 0.0;
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

YAML::Node number_node(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", value);
  return YAML::Node(std::string(text));
}

template <class Items, class Convert>
YAML::Node list_node(const Items& items, Convert convert) {
  YAML::Node node(YAML::NodeType::Sequence);
  for (const auto& item : items) node.push_back(convert(item));
  return node;
}

std::string dotted(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += text.empty() ? name : "." + name;
  return text;
}

std::vector<std::string> below(std::vector<std::string> names, const std::string& key) {
  names.push_back(key);
  return names;
}

/// The names in a dotted key of the command line. A joint's name may hold dots itself: of what is there already the
/// longest name is meant.
std::vector<std::string> names_in(const std::string& key, Entry& root) {
  std::vector<std::string> names;
  Entry* entry = &root;
  for (std::size_t begin = 0; begin <= key.size();) {
    std::size_t end = std::min(key.find('.', begin), key.size());
    for (std::size_t far = key.size(); entry != nullptr && far > end; far = key.rfind('.', far - 1)) {
      if (entry->find(key.substr(begin, far - begin)) != nullptr) end = far;
    }
    names.push_back(key.substr(begin, end - begin));
    if (entry != nullptr) entry = entry->find(names.back());
    begin = end + 1;
  }
  return names;
}

}  // namespace

struct Configuration::Document {
  Entry root;

  /// Marks every mapping on the way as known. Null when absent.
  Entry* find(const std::vector<std::string>& names) {
    Entry* entry = &root;
    for (const auto& name : names) {
      if (!entry->mapping) return nullptr;
      entry = entry->find(name);
      if (entry == nullptr) return nullptr;
      entry->known = true;
    }
    return entry;
  }

  /// Records a default so that print() shows what is in force.
  void remember(const std::vector<std::string>& section, const std::string& key, YAML::Node value) {
    Entry* entry = &root;
    for (const auto& name : section) {
      Entry* child = entry->find(name);
      if (child == nullptr) {
        entry->children.push_back({name, Entry{}});
        child = &entry->children.back().entry;
      }
      if (!child->mapping) {
        if (child->leaf.IsDefined() && !child->leaf.IsNull()) return;
        child->mapping = true;
      }
      child->known = true;
      entry = child;
    }
    if (Entry* child = entry->find(key)) {
      child->leaf = Leaf(value);
      child->known = true;
      return;
    }
    Entry child;
    child.known = true;
    child.leaf = Leaf(value);
    entry->children.push_back({key, std::move(child)});
  }
};

Configuration::Configuration(std::shared_ptr<Document> document, std::vector<std::string> section)
    : document_(std::move(document)), section_(std::move(section)) {}

Configuration Configuration::load(const fs::path& file, const std::vector<std::string>& overrides) {
  Reader reader;
  auto document = std::make_shared<Document>();
  document->root = reader.read_file(file);
  for (const auto& assignment : overrides) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw ConfigurationError("--set " + assignment + ": expected key.key=value");
    }
    YAML::Node value;
    try {
      value = YAML::Load(assignment.substr(equals + 1));
    } catch (const YAML::Exception& e) {
      throw ConfigurationError("--set " + assignment + ": the value is not valid YAML: " + e.msg);
    }
    Entry top = reader.convert(value, fs::path(), 0);
    top.file = "--set " + assignment;
    top.line = 0;
    const std::vector<std::string> names = names_in(assignment.substr(0, equals), document->root);
    for (auto it = names.rbegin(); it != names.rend(); ++it) {
      Entry parent;
      parent.mapping = true;
      parent.file = top.file;
      parent.children.push_back({*it, std::move(top)});
      top = std::move(parent);
    }
    merge_into(document->root, std::move(top));
  }
  Configuration configuration{document, {}};
  configuration.check_version();
  return configuration;
}

Configuration Configuration::parse(std::string_view yaml, const fs::path& directory) {
  Reader reader;
  auto document = std::make_shared<Document>();
  document->root = reader.read_text(std::string(yaml), directory / "configuration.yaml");
  Configuration configuration{document, {}};
  configuration.check_version();
  return configuration;
}

void Configuration::check_version() const {
  if (has("version")) (void)integer("version", kVersion, kVersion);
}

Configuration Configuration::section(const std::string& key) const {
  auto names = below(section_, key);
  if (const Entry* entry = document_->find(names)) {
    const bool empty = !entry->mapping && (!entry->leaf.IsDefined() || entry->leaf.IsNull());
    if (!entry->mapping && !empty) fail(key, "a mapping of keys");
  }
  return {document_, std::move(names)};
}

bool Configuration::has(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  return entry != nullptr && (entry->mapping || (entry->leaf.IsDefined() && !entry->leaf.IsNull()));
}

bool Configuration::is_mapping(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  return entry != nullptr && entry->mapping;
}

bool Configuration::is_list(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  return entry != nullptr && !entry->mapping && entry->leaf.IsSequence();
}

std::vector<std::string> Configuration::keys() const {
  std::vector<std::string> names;
  if (Entry* entry = document_->find(section_)) {
    for (auto& [name, child] : entry->children) {
      child.known = true;
      names.push_back(name);
    }
  }
  return names;
}

std::string Configuration::place(const std::string& key) const {
  const auto names = below(section_, key);
  const Entry* entry = document_->find(names);
  return where(entry != nullptr ? *entry : document_->root) + ": key '" + dotted(names) + "'";
}

void Configuration::fail(const std::string& key, const std::string& expected) const {
  const Entry* entry = document_->find(below(section_, key));
  throw ConfigurationError(place(key) + " is " + (entry != nullptr ? shown(*entry) : "missing") + "; expected " +
                           expected);
}

double Configuration::number(const std::string& key, double min, double max) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry != nullptr && !entry->mapping && entry->leaf.IsScalar()) {
    const auto value = parse_number(entry->leaf.Scalar());
    if (value && *value >= min && *value <= max) return *value;
  }
  fail(key, range_text("a number", min, max));
}

std::int64_t Configuration::integer(const std::string& key, std::int64_t min, std::int64_t max) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry != nullptr && !entry->mapping && entry->leaf.IsScalar()) {
    const std::string& text = entry->leaf.Scalar();
    std::int64_t value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc{} && stop == text.data() + text.size() && value >= min && value <= max) {
      return value;
    }
  }
  fail(key, range_text("a whole number", static_cast<double>(min), static_cast<double>(max)));
}

bool Configuration::boolean(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry != nullptr && !entry->mapping && entry->leaf.IsScalar()) {
    bool value = false;
    if (YAML::convert<bool>::decode(entry->leaf, value)) return value;
  }
  fail(key, "true or false");
}

std::string Configuration::text(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry == nullptr || entry->mapping || !entry->leaf.IsScalar()) fail(key, "a text");
  return substitute_environment(entry->leaf.Scalar(), place(key));
}

std::string Configuration::choice(const std::string& key, const std::vector<std::string>& choices) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry != nullptr && !entry->mapping && entry->leaf.IsScalar()) {
    const std::string value = entry->leaf.Scalar();
    if (std::find(choices.begin(), choices.end(), value) != choices.end()) return value;
  }
  std::string list;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    list += (i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ") + choices[i];
  }
  fail(key, list);
}

std::vector<double> Configuration::numbers(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry == nullptr || entry->mapping || !entry->leaf.IsSequence()) fail(key, "a list of numbers");
  std::vector<double> values;
  for (const auto& item : entry->leaf) {
    const auto value = item.IsScalar() ? parse_number(item.Scalar()) : std::nullopt;
    if (!value) fail(key, "a list of numbers");
    values.push_back(*value);
  }
  return values;
}

std::vector<std::vector<double>> Configuration::rows(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  constexpr const char* kExpected = "a list of equally long lists of numbers";
  if (entry == nullptr || entry->mapping || !entry->leaf.IsSequence()) fail(key, kExpected);
  std::vector<std::vector<double>> table;
  for (const auto& row : entry->leaf) {
    if (!row.IsSequence() || (!table.empty() && row.size() != table.front().size())) fail(key, kExpected);
    std::vector<double>& values = table.emplace_back();
    for (const auto& item : row) {
      const auto value = item.IsScalar() ? parse_number(item.Scalar()) : std::nullopt;
      if (!value) fail(key, kExpected);
      values.push_back(*value);
    }
  }
  return table;
}

std::vector<std::string> Configuration::texts(const std::string& key) const {
  const Entry* entry = document_->find(below(section_, key));
  if (entry == nullptr || entry->mapping || !entry->leaf.IsSequence()) fail(key, "a list of texts");
  std::vector<std::string> values;
  for (const auto& item : entry->leaf) {
    if (!item.IsScalar()) fail(key, "a list of texts");
    values.push_back(substitute_environment(item.Scalar(), place(key)));
  }
  return values;
}

fs::path Configuration::path(const std::string& key) const {
  const fs::path value = text(key);
  if (value.is_absolute()) return value;
  const Entry* entry = document_->find(below(section_, key));
  const fs::path directory = entry->line > 0 ? entry->file.parent_path() : fs::path();
  return (directory / value).lexically_normal();
}

std::vector<fs::path> Configuration::paths(const std::string& key) const {
  std::vector<fs::path> result;
  const std::vector<std::string> values = texts(key);
  const Entry* entry = document_->find(below(section_, key));
  const fs::path directory = entry->line > 0 ? entry->file.parent_path() : fs::path();
  for (const fs::path value : values) {
    result.push_back(value.is_absolute() ? value : (directory / value).lexically_normal());
  }
  return result;
}

double Configuration::number_or(const std::string& key, double fallback, double min, double max) const {
  if (!has(key)) document_->remember(section_, key, number_node(fallback));
  return has(key) ? number(key, min, max) : fallback;
}

std::int64_t Configuration::integer_or(const std::string& key, std::int64_t fallback, std::int64_t min,
                                       std::int64_t max) const {
  if (!has(key)) document_->remember(section_, key, YAML::Node(std::to_string(fallback)));
  return integer(key, min, max);
}

bool Configuration::boolean_or(const std::string& key, bool fallback) const {
  if (!has(key)) document_->remember(section_, key, YAML::Node(fallback ? "true" : "false"));
  return boolean(key);
}

std::string Configuration::text_or(const std::string& key, const std::string& fallback) const {
  if (!has(key)) document_->remember(section_, key, YAML::Node(fallback));
  return text(key);
}

std::string Configuration::choice_or(const std::string& key, const std::string& fallback,
                                     const std::vector<std::string>& choices) const {
  if (!has(key)) document_->remember(section_, key, YAML::Node(fallback));
  return choice(key, choices);
}

std::vector<double> Configuration::numbers_or(const std::string& key, const std::vector<double>& fallback) const {
  if (!has(key)) document_->remember(section_, key, list_node(fallback, number_node));
  return numbers(key);
}

std::vector<std::string> Configuration::texts_or(const std::string& key,
                                                 const std::vector<std::string>& fallback) const {
  if (!has(key)) {
    document_->remember(section_, key, list_node(fallback, [](const std::string& s) { return YAML::Node(s); }));
  }
  return texts(key);
}

void Configuration::reject_unknown_keys() const {
  const Entry* mapping = document_->find(section_);
  if (mapping != nullptr && mapping->mapping) {
    reject_unknown(*mapping, section_.empty() ? "" : dotted(section_) + ".");
  }
}

void Configuration::leave_to_others(const std::string& key) const {
  const auto pass = [](auto&& self, Entry& entry) -> void {
    entry.known = true;
    for (auto& child : entry.children) self(self, child.entry);
  };
  if (Entry* entry = document_->find(below(section_, key))) pass(pass, *entry);
}

void Configuration::reject_unknown_sections() const {
  const std::vector<std::string> valid(kSections.begin(), kSections.end());
  for (const auto& [name, child] : document_->root.children) {
    if (name == "version" || std::find(valid.begin(), valid.end(), name) != valid.end()) continue;
    throw ConfigurationError(where(child) + ": unknown key '" + name + "'; did you mean '" + nearest_name(name, valid) +
                             "'?");
  }
}

std::string Configuration::print() const {
  YAML::Emitter out;
  emit(out, document_->root);
  return std::string(out.c_str()) + "\n";
}

std::string Configuration::hash() const {
  return Digest().add(print()).text();
}

}  // namespace bodyschema
