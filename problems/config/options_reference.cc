// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/options_reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "problems/config/config_reader.h"
#include "problems/config/config_writer.h"

namespace semblance {
namespace {

using Kind = ConfigType::Kind;

std::vector<std::string> TypeNames(const ConfigType& type) {
  std::vector<std::string> names;
  for (const ConfigAlternative& alternative : type.alternatives) {
    names.push_back(alternative.name);
  }
  return names;
}

std::string TypeText(const ConfigType& type) {
  switch (type.kind) {
    case Kind::kBool:
      return "true or false";
    case Kind::kInteger:
      return "whole number";
    case Kind::kUnsigned:
      return "whole number, not negative";
    case Kind::kNumber:
      return "number";
    case Kind::kAutoNumber:
      return "number or auto";
    case Kind::kAny:
      return "any value";
    case Kind::kText:
      return "text";
    case Kind::kPath:
      return "path";
    case Kind::kWord:
      return fmt::format("one of {}", fmt::join(type.words, ", "));
    case Kind::kOptional:
      return TypeText(type.inner.front()) + " or null";
    case Kind::kArray:
      return fmt::format("list of {}: {}", type.size, TypeText(type.inner.front()));
    case Kind::kList:
      return fmt::format("list: {}", TypeText(type.inner.front()));
    case Kind::kMap:
      return fmt::format("map by name: {}", TypeText(type.inner.front()));
    case Kind::kStruct:
      return "map";
    case Kind::kVariant:
      return fmt::format("type, one of {}", fmt::join(TypeNames(type), ", "));
  }
  return "";
}

// The default, or "" for a struct, whose fields tell theirs.
std::string DefaultText(const ConfigField& field) {
  if (field.type.kind == Kind::kStruct) {
    return "";
  }
  const ConfigNode* type =
      field.type.kind == Kind::kVariant ? field.default_value.Find("type") : nullptr;
  return fmt::format(", default {}", ToFlowYaml(type ? *type : field.default_value));
}

std::string LimitText(const ConfigField& field) {
  const ConfigType& inner = field.type.kind == Kind::kMap ? field.type.inner.front() : field.type;
  const bool is_list = inner.kind == Kind::kList;
  FieldInfo info = field.info;
  std::string text;
  if (is_list && info.min > 0) {
    text = fmt::format(", at least {} of them{}", info.min,
                       field.type.kind == Kind::kMap ? " each" : "");
  }
  if (is_list) {
    info.min = FieldInfo{}.min;
  }
  const std::string range = RangeText(info);
  const std::string alone = info.unit.empty() ? "" : fmt::format(", in {}", info.unit);
  return text + (range.empty() ? alone : fmt::format(", {}", range));
}

void AddFields(const std::vector<ConfigField>& fields, const std::string& path,
               const std::string& condition, std::string& out);

void AddInside(const ConfigType& type, const std::string& path, const std::string& condition,
               std::string& out) {
  switch (type.kind) {
    case Kind::kStruct:
      return AddFields(type.fields, path, condition, out);
    case Kind::kOptional:
      return AddInside(type.inner.front(), path, condition, out);
    case Kind::kArray:
    case Kind::kList:
      return AddInside(type.inner.front(), path + "[]", condition, out);
    case Kind::kMap:
      return AddInside(type.inner.front(), JoinPath(path, "<name>"), condition, out);
    case Kind::kVariant:
      for (const ConfigAlternative& alternative : type.alternatives) {
        AddFields(alternative.fields, path,
                  fmt::format("{} (type: {})", condition, alternative.name), out);
      }
      return;
    default:
      return;
  }
}

void AddFields(const std::vector<ConfigField>& fields, const std::string& path,
               const std::string& condition, std::string& out) {
  for (const ConfigField& field : fields) {
    const std::string field_path = JoinPath(path, field.info.name);
    out += fmt::format("{}{}: {}{}{}\n", field_path, condition, TypeText(field.type),
                       DefaultText(field), LimitText(field));
    if (!field.info.doc.empty()) {
      out += fmt::format("    {}\n", field.info.doc);
    }
    AddInside(field.type, field_path, condition, out);
  }
}

}  // namespace

std::string ReferenceText(const ConfigType& type) {
  std::string out;
  AddInside(type, "", "", out);
  return out;
}

}  // namespace semblance
