// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/options_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "problems/config/value_json.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;
using Kind = ConfigType::Kind;

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

// A default value; the type tells a number from a text.
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
    case Kind::kNumber:  // a number that is not finite is no JSON
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

// The bare name of a type, or a map for each of them.
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
         "file that this one is laid over, relative to this file; of a list, each lies over those "
         "before it"}};
  }
  return schema.dump(2) + "\n";
}

}  // namespace semblance
