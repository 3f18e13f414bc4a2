#pragma once

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

 private:
  void skip_past(std::string_view end);
  std::string_view text_;
  std::size_t at_ = 0;
};

/// How deep the elements of an XML text nest.
int xml_depth(std::string_view text);

}  // namespace bodyschema
