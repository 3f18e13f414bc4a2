#include "collada_guard.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "xml_scan.hpp"

namespace bodyschema {
namespace {

constexpr int kMaxDepth = 100;
constexpr std::uint64_t kMaxNodes = 100'000;

struct Node {
  std::vector<std::size_t> below;           // nodes inside it
  std::vector<std::string_view> instances;  // names of nodes it instances
  enum class State { kNew, kOpen, kDone } state = State::kNew;
  std::uint64_t unfolded = 0;  // nodes it stands for, itself included
};

struct Scene {
  std::vector<Node> nodes;
  std::multimap<std::string_view, std::size_t> by_name;  // id, sid and name
  std::string danger;

  /// Counts what a node unfolds to. Recursion stops at kMaxDepth.
  std::uint64_t unfold(std::size_t index, int depth) {
    if (nodes[index].state == Node::State::kDone) return nodes[index].unfolded;
    if (nodes[index].state == Node::State::kOpen) {
      danger = "its nodes instance each other in a cycle";
    } else if (depth > kMaxDepth) {
      danger = "its nodes nest more than " + std::to_string(kMaxDepth) + " deep";
    }
    if (!danger.empty()) return 1;
    nodes[index].state = Node::State::kOpen;
    std::uint64_t count = 1;
    const auto add = [&](std::size_t child) {
      count += unfold(child, depth + 1);
      if (count > kMaxNodes && danger.empty()) {
        danger = "its nodes unfold to more than " + std::to_string(kMaxNodes);
      }
    };
    for (const std::size_t child : nodes[index].below) {
      if (danger.empty()) add(child);
    }
    for (const auto name : nodes[index].instances) {
      const auto [first, last] = by_name.equal_range(name);
      for (auto at = first; at != last && danger.empty(); ++at) add(at->second);
    }
    nodes[index].state = Node::State::kDone;
    nodes[index].unfolded = count;
    return count;
  }
};

/// Whether the content of an element, which starts here, is whole numbers between blanks and
/// nothing else. The mesh reader never gets past a character that it cannot read as part of one.
bool is_index_list(std::string_view content) {
  const auto end = std::min(content.find('<'), content.size());
  if (content.substr(end).starts_with("<![CDATA[")) return false;
  bool after_digit = false, after_sign = false;
  for (const char c : content.substr(0, end)) {
    const bool digit = c >= '0' && c <= '9';
    const bool sign = c == '-' || c == '+';
    const bool blank = c == ' ' || c == '\t' || c == '\n' || c == '\r';
    if (!(digit || blank || sign) || (sign && after_digit) || (after_sign && !digit)) return false;
    after_digit = digit;
    after_sign = sign;
  }
  return !after_sign;
}

/// A whole number of at most nine digits; an absent one is `fallback`, anything else is nothing.
std::optional<std::uint64_t> count_of(const XmlTag& tag, std::string_view key, std::uint64_t fallback) {
  const std::string_view text = tag.attribute(key);
  if (text.empty()) return fallback;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.size() > 9) return {};
  return value;
}

/// Every accessor of a mesh must stay inside its array; the mesh reader does not look.
std::string accessor_danger(std::string_view text) {
  struct Accessor {
    std::string_view source;
    std::uint64_t offset, count, stride, params;
    bool of_mesh;
  };
  std::map<std::string_view, std::uint64_t> values_of;  // by id of the array
  std::vector<Accessor> accessors;
  bool in_mesh = false;
  XmlScanner scanner(text);
  for (XmlTag tag; scanner.next(tag);) {
    if (tag.kind == XmlTag::Kind::kClose) {
      if (tag.name == "mesh") in_mesh = false;
      continue;
    }
    if (tag.name == "mesh") {
      in_mesh = tag.kind == XmlTag::Kind::kOpen;
    } else if (tag.name == "float_array") {
      const auto count = count_of(tag, "count", 0);
      if (!count) return "a <float_array> has no usable count";
      const auto [at, fresh] = values_of.emplace(tag.attribute("id"), *count);
      if (!fresh) at->second = std::min(at->second, *count);
    } else if (tag.name == "accessor") {
      std::string_view source = tag.attribute("source");
      if (source.starts_with('#')) source.remove_prefix(1);
      const auto offset = count_of(tag, "offset", 0), count = count_of(tag, "count", 0),
                 stride = count_of(tag, "stride", 1);
      if (!offset || !count || !stride) return "an <accessor> has no usable count";
      accessors.push_back({source, *offset, *count, *stride, 0, in_mesh});
    } else if (tag.name == "param" && !accessors.empty()) {
      ++accessors.back().params;
    }
  }
  for (const auto& accessor : accessors) {
    const auto array = values_of.find(accessor.source);
    if (array == values_of.end() && !accessor.of_mesh) continue;  // names, not numbers
    const std::uint64_t values = array == values_of.end() ? 0 : array->second;
    const std::uint64_t needed = accessor.count == 0 ? 0
                                                     : accessor.offset + (accessor.count - 1) * accessor.stride +
                                                           std::max(accessor.stride, accessor.params);
    if (needed > values) {
      return "an <accessor> reaches " + std::to_string(needed) + " values into <float_array> '" +
             std::string(accessor.source) + "' of " + std::to_string(values);
    }
  }
  return {};
}

}  // namespace

std::string collada_danger(std::string_view text) {
  if (std::string danger = xml_danger(text, kMaxDepth); !danger.empty()) return danger;
  if (std::string danger = accessor_danger(text); !danger.empty()) return danger;
  Scene scene;
  std::vector<std::size_t> open;
  std::vector<std::size_t> tops;
  XmlScanner scanner(text);
  for (XmlTag tag; scanner.next(tag);) {
    if (tag.kind == XmlTag::Kind::kOpen && (tag.name == "p" || tag.name == "vcount") &&
        !is_index_list(scanner.rest())) {
      return "its <" + std::string(tag.name) + "> holds something that is not a whole number";
    }
    if (tag.name == "node" && tag.kind != XmlTag::Kind::kClose) {
      const std::size_t index = scene.nodes.size();
      scene.nodes.emplace_back();
      std::set<std::string_view> names;  // id and name are often the same
      for (const char* key : {"id", "sid", "name"}) names.insert(tag.attribute(key));
      names.erase("");
      for (const auto name : names) scene.by_name.emplace(name, index);
      if (open.empty()) {
        tops.push_back(index);
      } else {
        scene.nodes[open.back()].below.push_back(index);
      }
      if (tag.kind == XmlTag::Kind::kOpen) open.push_back(index);
    } else if (tag.name == "node" && !open.empty()) {
      open.pop_back();
    } else if (tag.name == "instance_node" && tag.kind != XmlTag::Kind::kClose && !open.empty()) {
      std::string_view url = tag.attribute("url");
      if (url.starts_with('#')) url.remove_prefix(1);
      scene.nodes[open.back()].instances.push_back(url);
    }
  }
  std::uint64_t total = 0;
  for (const std::size_t top : tops) {
    total += scene.unfold(top, 0);
    if (!scene.danger.empty()) return scene.danger;
    if (total > kMaxNodes) return "its nodes unfold to more than " + std::to_string(kMaxNodes);
  }
  return {};
}

}  // namespace bodyschema
