// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/config_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>
#include <vector>

#include "problems/config/spelling_suggestion.h"
#include "problems/config/utf8_check.h"

namespace semblance::problems {
namespace {

void AddError(ConfigErrors& errors, const ConfigItem& item, std::string_view what) {
  errors.Add(item.node.location, item.path, what);
}

// Describes an entry for "expected a number, found ...".
std::string Describe(const ConfigNode& node) {
  switch (node.kind) {
    case ConfigNode::Kind::kNull:
      return "nothing (null)";
    case ConfigNode::Kind::kMap:
      return "a map";
    case ConfigNode::Kind::kList:
      return "a list";
    default:
      return node.quoted ? fmt::format("the text \"{}\"", node.text)
                         : fmt::format("'{}'", node.text);
  }
}

void AddKindError(ConfigErrors& errors, const ConfigItem& item, std::string_view expected) {
  AddError(errors, item, fmt::format("expected {}, found {}", expected, Describe(item.node)));
}

bool RequireScalar(ConfigErrors& errors, const ConfigItem& item, std::string_view expected) {
  if (!item.node.IsScalar()) {
    AddKindError(errors, item, expected);
  }
  return item.node.IsScalar();
}

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

std::string_view WithoutSign(std::string_view text) {
  const bool has_sign = text.starts_with('+') || text.starts_with('-');
  return has_sign ? text.substr(1) : text;
}

// Returns true for 010, 0o17, 0x1F and 0b11, which YAML readers read as different numbers.
bool LooksLikeOtherBase(std::string_view text) {
  const std::string_view digits = WithoutSign(text);
  return digits.size() > 1 && digits[0] == '0' &&
         (IsDigit(digits[1]) || std::string_view("xXoObB").find(digits[1]) != digits.npos);
}

bool LooksNonFinite(std::string_view text) {
  const std::string_view bare = WithoutSign(text);
  for (const std::string_view word : {".nan", ".inf", "nan", "inf", "infinity"}) {
    if (bare.size() == word.size() && EditDistance(bare, word) == 0) {
      return true;
    }
  }
  return false;
}

// Removes a plus sign, which std::from_chars does not accept.
std::string_view ForFromChars(std::string_view text) {
  const bool has_plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  return has_plus ? text.substr(1) : text;
}

// Reads `text` as a number. Returns nothing unless std::from_chars reads the whole text.
std::optional<double> ToDouble(std::string_view text, std::errc& error) {
  const std::string_view bare = ForFromChars(text);
  double value = 0;
  const auto result = std::from_chars(bare.data(), bare.data() + bare.size(), value);
  error = result.ec;
  const bool all = !bare.empty() && result.ptr == bare.data() + bare.size();
  return all && error != std::errc::invalid_argument ? std::optional(value) : std::nullopt;
}

// Checks that apply to whole and other numbers. Returns false if it added an error.
bool RequireNumberLike(ConfigErrors& errors, const ConfigItem& item, std::string_view expected) {
  if (!RequireScalar(errors, item, expected)) {
    return false;
  }
  const std::string& text = item.node.text;
  std::errc error{};
  if (item.node.quoted) {
    const std::string remedy = ToDouble(text, error) ? "; remove the quotes" : "";
    AddError(errors, item,
             fmt::format("expected {}, found {}{}", expected, Describe(item.node), remedy));
  } else if (LooksNonFinite(text)) {
    AddError(errors, item, fmt::format("'{}' is not finite; expected {}", text, expected));
  } else if (LooksLikeOtherBase(text)) {
    AddError(
        errors, item,
        fmt::format("'{}' is not a plain decimal; write {} without a leading 0", text, expected));
  } else {
    return true;
  }
  return false;
}

template <class Number>
bool RequireInRange(ConfigErrors& errors, const ConfigItem& item, Number value) {
  const auto as_double = static_cast<double>(value);
  if (as_double >= item.info.min && as_double <= item.info.max) {
    return true;
  }
  AddError(errors, item,
           fmt::format("{} is out of range; allowed is {}", item.node.text, RangeText(item.info)));
  return false;
}

template <class Integer>
void ReadInteger(ConfigErrors& errors, const ConfigItem& item, Integer& out) {
  constexpr std::string_view kExpected = "a whole number";
  if (!RequireNumberLike(errors, item, kExpected)) {
    return;
  }
  const std::string_view bare = ForFromChars(item.node.text);
  Integer value{};
  const auto [end, error] = std::from_chars(bare.data(), bare.data() + bare.size(), value);
  std::errc as_double{};
  const bool is_whole =
      WithoutSign(bare).find_first_not_of("0123456789") == bare.npos && !WithoutSign(bare).empty();
  if (is_whole && (error != std::errc() || end != bare.data() + bare.size())) {
    AddError(errors, item,
             fmt::format("{} does not fit; allowed is {} to {}", item.node.text,
                         std::numeric_limits<Integer>::min(), std::numeric_limits<Integer>::max()));
  } else if (!is_whole && ToDouble(item.node.text, as_double)) {
    AddError(errors, item,
             fmt::format("expected a whole number, found {}; write only digits", item.node.text));
  } else if (!is_whole) {
    AddKindError(errors, item, kExpected);
  } else if (RequireInRange(errors, item, value)) {
    out = value;
  }
}

// Resolves a path. If a run's folder was moved to another machine, the absolute paths in its
// resolved.yaml no longer exist; then a file of the same name in `folder` is taken. The bytes of a
// name may differ from those on disk if both are the same text in Unicode.
std::filesystem::path FoundPath(const std::filesystem::path& folder, const std::string& text) {
  std::filesystem::path named = std::filesystem::absolute(folder / text).lexically_normal();
  for (const NormalForm form : {NormalForm::kComposed, NormalForm::kDecomposed}) {
    const std::filesystem::path same = Normalized(named.string(), form);
    std::error_code error;
    if (!std::filesystem::exists(named, error) && std::filesystem::exists(same, error)) {
      named = same;
    }
  }
  const std::filesystem::path beside =
      std::filesystem::absolute(folder / named.filename()).lexically_normal();
  std::error_code ignored;
  const bool moved = std::filesystem::path(text).is_absolute() &&
                     !std::filesystem::exists(named, ignored) &&
                     std::filesystem::exists(beside, ignored);
  return moved ? beside : named;
}

}  // namespace

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, bool& out) {
  const ConfigNode& node = item.node;
  if (node.IsScalar() && !node.quoted && (node.text == "true" || node.text == "false")) {
    out = node.text == "true";
  } else {
    AddKindError(errors, item, "true or false");
  }
}

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, int& out) {
  ReadInteger(errors, item, out);
}

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::uint64_t& out) {
  ReadInteger(errors, item, out);
}

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, double& out) {
  if (!RequireNumberLike(errors, item, "a number")) {
    return;
  }
  std::errc error{};
  const std::optional<double> value = ToDouble(item.node.text, error);
  if (!value) {
    const bool has_comma = item.node.text.find(',') != std::string::npos;
    AddError(errors, item,
             fmt::format("expected a number, found {}{}", Describe(item.node),
                         has_comma ? "; the decimal sign is a point" : ""));
  } else if (error == std::errc::result_out_of_range || !std::isfinite(*value)) {
    AddError(errors, item,
             fmt::format("{} does not fit; expected a number between 1e-308 and 1e308 in size",
                         item.node.text));
  } else if (RequireInRange(errors, item, *value)) {
    out = *value;
  }
}

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, AutoOr<double>& out) {
  if (item.node.IsScalar() && !item.node.quoted && item.node.text == "auto") {
    out.automatic = true;
    return;
  }
  const std::size_t before = errors.size();
  ReadScalar(errors, item, out.value);
  out.automatic = out.automatic && errors.size() != before;
}

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::string& out) {
  if (RequireScalar(errors, item, "a text")) {
    out = Normalized(item.node.text);
  }
}

void ReadScalar(ConfigErrors& errors, const ConfigItem& item, std::filesystem::path& out) {
  if (!RequireScalar(errors, item, "a path")) {
    return;
  }
  const std::string& text = item.node.text;
  if (text.starts_with('~')) {
    AddError(errors, item, fmt::format("'{}': ~ is not expanded; write the whole path", text));
  } else if (text.find('\0') != text.npos) {
    AddError(errors, item, "a path cannot have the character NUL (\\0); leave it out");
  } else if (text.empty()) {
    out.clear();
  } else {
    const auto& source = item.node.location.source;
    const std::filesystem::path folder = source ? source->folder : std::filesystem::path();
    out = FoundPath(folder, text);
  }
}

void ReadScalar(ConfigErrors&, const ConfigItem& item, ConfigNode& out) { out = item.node; }

std::optional<std::size_t> ReadWord(ConfigErrors& errors, const ConfigItem& item,
                                    std::string_view what, std::span<const std::string> words) {
  if (!item.node.IsScalar()) {
    AddError(errors, item,
             fmt::format("expected a {}, found {}; known are: {}", what, Describe(item.node),
                         fmt::join(words, ", ")));
    return std::nullopt;
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == item.node.text) {
      return i;
    }
  }
  const std::string nearest = NearestWord(item.node.text, words);
  AddError(
      errors, item,
      fmt::format("unknown {} '{}'; known are: {}{}", what, item.node.text, fmt::join(words, ", "),
                  nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
  return std::nullopt;
}

std::optional<std::size_t> ReadTypeName(ConfigErrors& errors, const ConfigItem& item,
                                        std::span<const std::string> names,
                                        std::optional<std::size_t> default_index) {
  if (!item.node.IsMap()) {
    return ReadWord(errors, item, "type", names);
  }
  if (const ConfigNode* type = item.node.Find("type")) {
    return ReadWord(errors, {*type, JoinPath(item.path, "type"), item.info}, "type", names);
  }
  if (!default_index) {
    AddError(errors, item, fmt::format("'type' is missing; known are: {}", fmt::join(names, ", ")));
  }
  return default_index;
}

bool RequireMap(ConfigErrors& errors, const ConfigItem& item) {
  if (!item.node.IsMap()) {
    AddKindError(errors, item, "a map");
  }
  return item.node.IsMap();
}

bool RequireList(ConfigErrors& errors, const ConfigItem& item) {
  if (!item.node.IsList()) {
    AddKindError(errors, item, "a list");
  }
  return item.node.IsList();
}

bool RequireSize(ConfigErrors& errors, const ConfigItem& item, std::optional<std::size_t> size) {
  const std::size_t found = item.node.items.size();
  const bool fits = size ? found == *size : static_cast<double>(found) >= item.info.min;
  if (!fits) {
    const std::string expected =
        size ? fmt::format("{}", *size) : fmt::format("at least {:g}", item.info.min);
    AddError(errors, item, fmt::format("expected a list of {}, found {}", expected, found));
  }
  return fits;
}

void RefuseUnknownKeys(ConfigErrors& errors, const ConfigItem& item,
                       std::span<const std::string> known) {
  for (const ConfigNode::Entry& entry : item.node.entries) {
    bool is_known = false;
    for (const std::string& name : known) {
      is_known = is_known || name == entry.key;
    }
    if (!is_known) {
      errors.Add(entry.key_location, JoinPath(item.path, entry.key),
                 fmt::format("unknown key{}", Suggestion(entry.key, known)));
    }
  }
}

std::string RangeText(const FieldInfo& info) {
  const bool has_min = std::isfinite(info.min), has_max = std::isfinite(info.max);
  const std::string unit = info.unit.empty() ? "" : fmt::format(" {}", info.unit);
  if (has_min && has_max) {
    return fmt::format("{} to {}{}", info.min, info.max, unit);
  }
  if (has_min) {
    return fmt::format("at least {}{}", info.min, unit);
  }
  return has_max ? fmt::format("at most {}{}", info.max, unit) : "";
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

}  // namespace semblance::problems
