#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace bodyschema {

/// One tag of an XML text: <name ...>, </name> or <name .../>.
struct XmlTag {
  enum class Kind { kOpen, kClose, kEmpty };
  Kind kind = Kind::kOpen;
  std::string_view name;
  std::string_view attributes;  ///< what stands between name and closing bracket

  /// The value of an attribute, entities as written; empty when absent.
  [[nodiscard]] std::string_view attribute(std::string_view key) const;
};

/// Runs through the tags of an XML text without recursion and without a tree. It is not a parser:
/// it serves to turn hostile files away (endless nesting) before a recursive parser sees them.
/// Comments, CDATA and declarations are skipped. The text must outlive the scanner.
class XmlScanner {
 public:
  explicit XmlScanner(std::string_view text) : text_(text) {}
  /// False at the end of the text.
  bool next(XmlTag& tag);
  /// What follows the last tag, to the end of the text.
  [[nodiscard]] std::string_view rest() const { return text_.substr(at_); }
  /// Whether what was scanned held a declaration `<!...>`, a `<?...>` other than a plain <?xml ...?> at the
  /// beginning, or a tag without a name.
  [[nodiscard]] bool odd() const { return odd_; }

 private:
  [[nodiscard]] bool begins_text(std::size_t at) const;
  void skip_past(std::string_view start, std::string_view end);
  std::string_view text_;
  std::size_t at_ = 0;
  bool odd_ = false;
};

/// Why a recursive parser should not see this text: its elements nest too deep, end more often than they
/// begin, it declares entities (which may stand for gigabytes), or parsers may see other tags in it than the
/// scanner does. Empty when there is nothing.
std::string xml_danger(std::string_view text, int max_depth);

}  // namespace bodyschema
