// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "problems/config/config_describe.h"
#include "problems/config/config_reader.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

// Whether every reader of YAML takes the bare text as a text.
bool IsPlainText(std::string_view text) {
  constexpr std::array<std::string_view, 12> kOther = {
      "null", "true", "false", "yes", "no", "on", "off", "y", "n", "nan", "inf", "infinity"};
  std::string lower;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 ||
        !(std::isalnum(byte) || std::string_view("_./-").find(c) != std::string_view::npos)) {
      return false;
    }
    lower += static_cast<char>(std::tolower(byte));
  }
  const bool has_first = !lower.empty() && (std::isalpha(static_cast<unsigned char>(lower[0])) ||
                                            lower[0] == '/' || lower[0] == '_');
  return has_first && std::find(kOther.begin(), kOther.end(), lower) == kOther.end();
}

std::string QuotedText(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      out += fmt::format("\\x{:02X}", byte);
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string TextOf(std::string_view text) {
  return IsPlainText(text) ? std::string(text) : QuotedText(text);
}

// Whether the node goes on the line of its key.
bool IsInline(const ConfigNode& node) {
  const auto is_leaf = [](const ConfigNode& item) { return item.IsScalar() || item.IsNull(); };
  return is_leaf(node) || (node.IsMap() && node.entries.empty()) ||
         (node.IsList() && std::all_of(node.items.begin(), node.items.end(), is_leaf));
}

void AddBlock(const ConfigNode& node, std::size_t indent, std::string& out) {
  const std::string margin(indent, ' ');
  if (IsInline(node)) {
    out += fmt::format("{}{}\n", margin, ToFlowYaml(node));
  } else if (node.IsMap()) {
    for (const ConfigNode::Entry& entry : node.entries) {
      out += fmt::format("{}{}:", margin, TextOf(entry.key));
      if (IsInline(entry.value)) {
        out += fmt::format(" {}\n", ToFlowYaml(entry.value));
      } else {
        out += "\n";
        AddBlock(entry.value, indent + 2, out);
      }
    }
  } else {
    for (const ConfigNode& item : node.items) {
      const std::size_t begin = out.size();
      AddBlock(item, indent + 2, out);
      out[begin + indent] = '-';
    }
  }
}

void RequireFinite(const ConfigNode& node, const std::string& path) {
  if (node.IsScalar() && !node.quoted &&
      (node.text.ends_with("nan") || node.text.ends_with("inf"))) {
    throw InputError(fmt::format(
        "{}: {} cannot be written to a configuration; only finite numbers can", path, node.text));
  }
  for (const ConfigNode::Entry& entry : node.entries) {
    RequireFinite(entry.value, JoinPath(path, entry.key));
  }
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    RequireFinite(node.items[i], JoinPath(path, i));
  }
}

}  // namespace

std::string ToFlowYaml(const ConfigNode& tree) {
  if (tree.IsNull()) {
    return "null";
  }
  if (tree.IsScalar()) {
    return tree.quoted ? TextOf(tree.text) : tree.text;
  }
  std::string inside;
  for (const ConfigNode::Entry& entry : tree.entries) {
    inside += fmt::format("{}{}: {}", inside.empty() ? "" : ", ", TextOf(entry.key),
                          ToFlowYaml(entry.value));
  }
  for (const ConfigNode& item : tree.items) {
    inside += fmt::format("{}{}", inside.empty() ? "" : ", ", ToFlowYaml(item));
  }
  return tree.IsMap() ? fmt::format("{{{}}}", inside) : fmt::format("[{}]", inside);
}

std::string ToYaml(const ConfigNode& tree) {
  RequireFinite(tree, "");
  std::string out;
  AddBlock(tree, 0, out);
  return out;
}

namespace config_internal {

ConfigNode ScalarToTree(bool value) { return ConfigNode::Scalar(value ? "true" : "false"); }

ConfigNode ScalarToTree(int value) { return ConfigNode::Scalar(fmt::format("{}", value)); }

ConfigNode ScalarToTree(std::uint64_t value) {
  return ConfigNode::Scalar(fmt::format("{}", value));
}

ConfigNode ScalarToTree(const AutoOr<double>& value) {
  return value.automatic ? ConfigNode::Scalar("auto") : ScalarToTree(value.value);
}
ConfigNode ScalarToTree(double value) { return ConfigNode::Scalar(fmt::format("{}", value)); }

ConfigNode ScalarToTree(const std::string& value) { return ConfigNode::Quoted(value); }

ConfigNode ScalarToTree(const std::filesystem::path& value) {
  return ConfigNode::Quoted(
      value.empty() ? "" : std::filesystem::absolute(value).lexically_normal().string());
}

}  // namespace config_internal
}  // namespace semblance
