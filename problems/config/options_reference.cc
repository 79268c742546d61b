// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/options_reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "problems/config/config_reader.h"
#include "problems/config/config_tree.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;
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

// Describes the default. Returns "" for a struct, whose fields have their own defaults.
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

Json ToJson(const ConfigNode& node, const ConfigType& type);

Json FieldsToJson(const ConfigNode& node, const std::vector<ConfigField>& fields, Json out) {
  for (const ConfigField& field : fields) {
    if (const ConfigNode* value = node.Find(field.info.name)) {
      out[std::string(field.info.name)] = ToJson(*value, field.type);
    }
  }
  return out;
}

Json VariantToJson(const ConfigNode& node, const ConfigType& type) {
  const ConfigNode* name = node.Find("type");
  for (const ConfigAlternative& alternative : type.alternatives) {
    if (name && alternative.name == name->text) {
      return FieldsToJson(node, alternative.fields, Json{{"type", name->text}});
    }
  }
  return nullptr;
}

// Converts a value. The type decides between a number and a text.
Json ToJson(const ConfigNode& node, const ConfigType& type) {
  Json list = Json::array();
  Json map = Json::object();
  switch (type.kind) {
    case Kind::kOptional:
      return node.IsNull() ? Json(nullptr) : ToJson(node, type.inner.front());
    case Kind::kArray:
    case Kind::kList:
      for (const ConfigNode& item : node.items) {
        list.push_back(ToJson(item, type.inner.front()));
      }
      return list;
    case Kind::kMap:
      for (const ConfigNode::Entry& entry : node.entries) {
        map[entry.key] = ToJson(entry.value, type.inner.front());
      }
      return map;
    case Kind::kStruct:
      return FieldsToJson(node, type.fields, map);
    case Kind::kVariant:
      return VariantToJson(node, type);
    case Kind::kBool:
    case Kind::kInteger:
    case Kind::kUnsigned:
    case Kind::kAutoNumber:
      return Json::accept(node.text) ? Json::parse(node.text) : Json(node.text);
    case Kind::kNumber:  // JSON has no number that is not finite
      return Json::accept(node.text) ? Json::parse(node.text) : Json(nullptr);
    default:
      return node.text;
  }
}

Json TypeSchema(const ConfigType& type, const FieldInfo& info);

Json ObjectSchema(const std::vector<ConfigField>& fields) {
  Json properties = Json::object();
  for (const ConfigField& field : fields) {
    Json schema = TypeSchema(field.type, field.info);
    std::string doc(field.info.doc);
    if (!field.info.unit.empty()) {
      doc += fmt::format("{}[{}]", doc.empty() ? "" : " ", field.info.unit);
    }
    if (!doc.empty()) {
      schema["description"] = doc;
    }
    schema["default"] = ToJson(field.default_value, field.type);
    properties[std::string(field.info.name)] = std::move(schema);
  }
  return {{"type", "object"}, {"properties", properties}, {"additionalProperties", false}};
}

// Allows the bare name of a type, or a map for each type.
Json VariantSchema(const ConfigType& type) {
  Json names = Json::array();
  Json any_of = Json::array();
  for (const ConfigAlternative& alternative : type.alternatives) {
    names.push_back(alternative.name);
    Json schema = ObjectSchema(alternative.fields);
    schema["properties"]["type"] = {{"const", alternative.name}};
    any_of.push_back(std::move(schema));
  }
  any_of.insert(any_of.begin(), Json{{"enum", names}});
  return {{"anyOf", any_of}};
}

Json NumberSchema(const char* type, const FieldInfo& info) {
  Json schema{{"type", type}};
  if (std::isfinite(info.min)) {
    schema["minimum"] = info.min;
  }
  if (std::isfinite(info.max)) {
    schema["maximum"] = info.max;
  }
  return schema;
}

Json ListSchema(const ConfigType& type, const FieldInfo& info) {
  FieldInfo item_info = info;
  Json schema{{"type", "array"}};
  if (type.kind == Kind::kArray) {
    schema["minItems"] = schema["maxItems"] = type.size;
  } else {
    item_info.min = FieldInfo{}.min;
    if (info.min > 0) {
      schema["minItems"] = static_cast<std::uint64_t>(std::ceil(info.min));
    }
  }
  schema["items"] = TypeSchema(type.inner.front(), item_info);
  return schema;
}

Json TypeSchema(const ConfigType& type, const FieldInfo& info) {
  FieldInfo not_negative = info;
  not_negative.min = std::max(info.min, 0.0);
  switch (type.kind) {
    case Kind::kBool:
      return {{"type", "boolean"}};
    case Kind::kInteger:
      return NumberSchema("integer", info);
    case Kind::kUnsigned:
      return NumberSchema("integer", not_negative);
    case Kind::kNumber:
      return NumberSchema("number", info);
    case Kind::kAutoNumber:
      return {{"anyOf", {NumberSchema("number", info), {{"const", "auto"}}}}};
    case Kind::kAny:
      return Json::object();
    case Kind::kWord:
      return {{"enum", type.words}};
    case Kind::kOptional:
      return {{"anyOf", {TypeSchema(type.inner.front(), info), {{"type", "null"}}}}};
    case Kind::kArray:
    case Kind::kList:
      return ListSchema(type, info);
    case Kind::kMap:
      return {{"type", "object"}, {"additionalProperties", TypeSchema(type.inner.front(), info)}};
    case Kind::kStruct:
      return ObjectSchema(type.fields);
    case Kind::kVariant:
      return VariantSchema(type);
    default:
      return {{"type", "string"}};
  }
}

}  // namespace

std::string ReferenceText(const ConfigType& type) {
  std::string out;
  AddInside(type, "", "", out);
  return out;
}

Json ValueJson(const ConfigNode& tree, const ConfigType& type) { return ToJson(tree, type); }

std::string SchemaText(const ConfigType& type) {
  Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"}};
  schema.update(TypeSchema(type, FieldInfo{}));
  if (type.kind == Kind::kStruct && !schema["properties"].contains("base")) {
    schema["properties"]["base"] = {
        {"type", Json::array({"string", "array"})},
        {"items", {{"type", "string"}}},
        {"minItems", 1},
        {"description",
         "file that this one is merged over, relative to this file; in a list, each is merged over "
         "those before it"}};
  }
  return schema.dump(2) + "\n";
}

}  // namespace semblance::problems
