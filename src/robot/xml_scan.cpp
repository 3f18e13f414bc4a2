#include "xml_scan.hpp"

#include <algorithm>

namespace bodyschema {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

}  // namespace

void XmlScanner::skip_past(std::string_view start, std::string_view end) {
  // From after the start: the bracket of "<!-->" ends nothing.
  const auto found = text_.find(end, at_ + start.size());
  at_ = found == std::string_view::npos ? text_.size() : found + end.size();
}

bool XmlScanner::next(XmlTag& tag) {
  while ((at_ = text_.find('<', at_)) != std::string_view::npos) {
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with("<!--")) {
      skip_past("<!--", "-->");
    } else if (rest.starts_with("<![CDATA[")) {
      skip_past("<![CDATA[", "]]>");
    } else if (rest.starts_with("<?") || rest.starts_with("<!")) {
      // Parsers do not agree on where these end: some at the first bracket, some not.
      const auto bracket = rest.find('>');
      if (rest[1] == '!' || bracket == std::string_view::npos || rest[bracket - 1] != '?') odd_ = true;
      skip_past("<?", ">");
    } else {
      // A closing bracket inside a quoted attribute does not end the tag.
      char quote = 0;
      std::size_t end = at_ + 1;
      for (; end < text_.size() && (quote != 0 || text_[end] != '>'); ++end) {
        const char c = text_[end];
        if (quote != 0) {
          if (c == quote) quote = 0;
        } else if (c == '"' || c == '\'') {
          quote = c;
        }
      }
      std::string_view inside = text_.substr(at_ + 1, end - at_ - 1);
      at_ = std::min(end + 1, text_.size());
      tag.kind = XmlTag::Kind::kOpen;
      if (inside.starts_with('/')) {
        tag.kind = XmlTag::Kind::kClose;
        inside.remove_prefix(1);
      } else if (inside.ends_with('/')) {
        tag.kind = XmlTag::Kind::kEmpty;
        inside.remove_suffix(1);
      }
      const auto name_end = std::min(inside.find_first_of(kSpace), inside.size());
      tag.name = inside.substr(0, name_end);
      tag.attributes = inside.substr(name_end);
      return true;
    }
  }
  at_ = text_.size();
  return false;
}

std::string_view XmlTag::attribute(std::string_view key) const {
  std::string_view rest = attributes;
  while (true) {
    rest.remove_prefix(std::min(rest.find_first_not_of(kSpace), rest.size()));
    const auto equals = rest.find('=');
    if (equals == std::string_view::npos) return {};
    std::string_view found = rest.substr(0, equals);
    found = found.substr(0, std::min(found.find_first_of(kSpace), found.size()));
    const auto open = rest.find_first_of("\"'", equals);
    if (open == std::string_view::npos) return {};
    const auto close = rest.find(rest[open], open + 1);
    if (close == std::string_view::npos) return {};
    if (found == key) return rest.substr(open + 1, close - open - 1);
    rest.remove_prefix(close + 1);
  }
}

std::string xml_danger(std::string_view text, int max_depth) {
  int depth = 0;
  int deepest = 0;
  XmlScanner scanner(text);
  for (XmlTag tag; scanner.next(tag);) {
    if (tag.kind == XmlTag::Kind::kOpen) deepest = std::max(deepest, ++depth);
    // Parsers pass over an end without a start, so it must not make room for more below.
    if (tag.kind == XmlTag::Kind::kClose && --depth < 0) {
      return "</" + std::string(tag.name.substr(0, 40)) + "> ends an element that has not begun";
    }
  }
  if (scanner.odd()) return "it declares a document type, entities or the like, none expected";
  if (deepest <= max_depth) return {};
  return "elements nest " + std::to_string(deepest) + " deep, at most " + std::to_string(max_depth) + " expected";
}

}  // namespace bodyschema
