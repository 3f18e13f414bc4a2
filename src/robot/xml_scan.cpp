#include "xml_scan.hpp"

#include <algorithm>
#include <cctype>

namespace bodyschema {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool begins_name(char c) {
  return is_letter(c) || c == '_' || static_cast<unsigned char>(c) >= 0x80;
}

std::string_view without_blanks(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  return text;
}

/// Whether `text` starts with <?xml ...?> whose values hold nothing that could be taken for the end of anything.
bool is_plain_declaration(std::string_view text) {
  static constexpr std::string_view kStart = "<?xml";
  if (!text.starts_with(kStart)) return false;
  text.remove_prefix(kStart.size());
  while (true) {
    const std::string_view rest = without_blanks(text);
    if (rest.starts_with("?>")) return true;
    if (rest.size() == text.size()) return false;  // a blank stands before each of the names
    text = rest;
    while (!text.empty() && is_letter(text.front())) text.remove_prefix(1);
    text = without_blanks(text);
    if (!text.starts_with('=')) return false;
    text = without_blanks(text.substr(1));
    if (text.empty() || (text.front() != '"' && text.front() != '\'')) return false;
    const char quote = text.front();
    text.remove_prefix(1);
    while (!text.empty() && (is_letter(text.front()) || is_digit(text.front()) || text.front() == '.' ||
                             text.front() == '-' || text.front() == '_')) {
      text.remove_prefix(1);
    }
    if (!text.starts_with(quote)) return false;
    text.remove_prefix(1);
  }
}

/// TinyXML takes the ';' that ends a numbered character wherever it is, and as many bytes as the first of a
/// character in UTF-8 asks for, whatever they are: tags in between would go unseen.
std::string swallowed_markup(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == '&' && text.substr(i + 1).starts_with('#')) {
      const bool hexadecimal = text.substr(i + 2).starts_with('x');
      const std::size_t first = i + (hexadecimal ? 3 : 2);
      std::size_t end = first;
      while (end < text.size() &&
             (hexadecimal ? std::isxdigit(static_cast<unsigned char>(text[end])) != 0 : is_digit(text[end]))) {
        ++end;
      }
      if (end == first || !text.substr(end).starts_with(';')) {
        return "a numbered character has no number, expected &#65; or &#x41;";
      }
    }
    const std::size_t length = c < 0xC2 ? 1 : c < 0xE0 ? 2 : c < 0xF0 ? 3 : c < 0xF5 ? 4 : 1;
    if (text.substr(i + 1, length - 1).find_first_of("<>&\"'") != std::string_view::npos) {
      return "a character is cut short, UTF-8 expected";
    }
  }
  return {};
}

}  // namespace

bool XmlScanner::begins_text(std::size_t at) const {
  std::string_view before = text_.substr(0, at);
  if (before.starts_with("\xEF\xBB\xBF")) before.remove_prefix(3);
  return without_blanks(before).empty();
}

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
      // Parsers do not agree on where these end: at the first bracket, at the first outside quotes, at "?>".
      if (!begins_text(at_) || !is_plain_declaration(rest)) odd_ = true;
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
      // Parsers do not take it for an element, and may not heed its quotes.
      if (tag.name.empty() || !begins_name(tag.name.front())) odd_ = true;
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
  if (std::string swallowed = swallowed_markup(text); !swallowed.empty()) return swallowed;
  if (scanner.odd()) return "it declares a document type, entities or the like, none expected";
  if (deepest <= max_depth) return {};
  return "elements nest " + std::to_string(deepest) + " deep, at most " + std::to_string(max_depth) + " expected";
}

}  // namespace bodyschema
