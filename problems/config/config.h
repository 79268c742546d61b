// SPDX-License-Identifier: GPL-3.0-or-later
// Strict configuration: YAML to structs with a `Fields` list (surfaces/base/fields.h), and back.
// Also for data files (tissue tables, landmarks, networks), which are YAML read with the same
// strictness.
//
// Every field may be left out and then keeps its default; an empty file is all defaults. Everything
// else that is not exactly right is an error: unknown and repeated keys, null where the field is
// not optional, quoted numbers, whole numbers written 1e3 or 1.0, numbers with a leading zero or
// in another base, nan and inf, yes/no/on/off, values out of range, anchors, aliases, tags, merge
// keys, tabs, a second document. All errors are reported at once, one per line, as
//     file:line:column: path: what; did you mean 'x'?
//
// `base: other.yaml` at the top lays the file over another one, `base: [a.yaml, b.yaml]` over
// b.yaml and that over a.yaml: maps merge key by key, lists and scalars replace, a variant of
// another `type` replaces wholly. Bases may have bases. Paths are relative to their own file.
//
// Overrides ("a.b[0].c=v", v in YAML) come last and name themselves in errors: `--set a.b=c: ...`.
// Paths in them are relative to the current folder. They reach into default lists and variants too.
// "a.type=b" replaces a variant of another type wholly, but for what other overrides say of it.
//
// A variant is written as a map with `type`, or as the bare name of a type for its defaults. A map
// without `type` sets options of the field's default type; in a list, `type` must be there.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "problems/config/config_binder.h"
#include "problems/config/config_describe.h"
#include "problems/config/config_errors.h"
#include "problems/config/config_tree.h"
#include "problems/config/config_writer.h"
#include "problems/config/options_reference.h"
#include "problems/config/options_schema.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {

// The tree of one YAML text; what a tree cannot tell apart (repeated keys, anchors, tags ...) is
// complained about here. Null for an empty text; an empty map after a syntax error.
ConfigNode ParseConfigText(std::string_view text, const ConfigSource& source, ConfigErrors& errors);

// The tree of a file (or of a text that pretends to be one) with its bases below and the overrides
// above it. `defaults` is the tree of the default values, for overrides. Throws IoError if the file
// itself cannot be read; a base that cannot is among the errors.
ConfigNode LoadConfigTree(const std::filesystem::path& file, std::span<const std::string> overrides,
                          const ConfigNode& defaults, ConfigErrors& errors);
ConfigNode LoadConfigTextTree(std::string_view text, const std::filesystem::path& pretend_file,
                              std::span<const std::string> overrides, const ConfigNode& defaults,
                              ConfigErrors& errors);

// How many keys the two maps share.
int CommonKeys(const ConfigNode& a, const ConfigNode& b);

// The tree of all fields, defaults for a default value.
template <class T>
ConfigNode ConfigTreeOf(const T& value) {
  return config_internal::ToTree(value);
}

// The value of a tree; entries that are wrong are added to `errors` and keep their defaults. Where
// none is wrong, and there is a FaultsBetween(T), its faults are.
template <class T>
T ReadConfigTree(const ConfigNode& tree, ConfigErrors& errors) {
  T value{};
  const std::size_t errors_before = errors.size();
  config_internal::ReadValue(errors, {tree, "", FieldInfo{}}, value);
  if constexpr (requires { FaultsBetween(value); }) {
    if (errors.size() == errors_before) {
      for (const OptionFault& fault : FaultsBetween(value)) {
        errors.Add(LocationOf(tree, fault.path), fault.path, fault.what);
      }
    }
  }
  return value;
}

// Throws ConfigError with all errors, IoError if the file cannot be read.
template <class T>
T ReadConfig(const std::filesystem::path& file, std::span<const std::string> overrides = {}) {
  ConfigErrors errors;
  const ConfigNode tree = LoadConfigTree(file, overrides, ConfigTreeOf(T{}), errors);
  T value = ReadConfigTree<T>(tree, errors);
  errors.ThrowIfAny();
  return value;
}

// How many of the keys at the top of a file and its bases are fields of T: tells what a file is
// for. 0 for a file that cannot be read as YAML. Throws IoError if it cannot be read at all.
template <class T>
int KnownKeys(const std::filesystem::path& file) {
  ConfigErrors errors;
  const ConfigNode fields = ConfigTreeOf(T{});
  return CommonKeys(LoadConfigTree(file, {}, fields, errors), fields);
}

// The same without its bases, and without the key `base`, which every kind of file may have.
template <class T>
int OwnKeys(const std::filesystem::path& file) {
  ConfigErrors errors;
  const ConfigNode tree = ParseConfigText(
      ReadFileBytes(file), {.name = file.string(), .folder = file.parent_path()}, errors);
  ConfigNode fields = ConfigTreeOf(T{});
  std::erase_if(fields.entries, [](const auto& entry) { return entry.key == "base"; });
  return CommonKeys(tree, fields);
}

// The same as ReadConfig for a text, as if it stood in `pretend_file`, which need not exist.
template <class T>
T ReadConfigText(std::string_view text, const std::filesystem::path& pretend_file,
                 std::span<const std::string> overrides = {}) {
  ConfigErrors errors;
  const ConfigNode tree =
      LoadConfigTextTree(text, pretend_file, overrides, ConfigTreeOf(T{}), errors);
  T value = ReadConfigTree<T>(tree, errors);
  errors.ThrowIfAny();
  return value;
}

// Resolved YAML: every field, explicit; reading it gives the same value bit for bit. Paths are
// written absolute. Throws InputError if a number is not finite.
template <class T>
std::string WriteConfig(const T& value) {
  return ToYaml(ConfigTreeOf(value));
}

// For people: each path with its type, default, range, unit and meaning.
template <class T>
std::string OptionsReference() {
  return ReferenceText(config_internal::DescribeType(T{}));
}

// For editors: a JSON Schema (draft 2020-12).
template <class T>
std::string OptionsSchema() {
  return SchemaText(config_internal::DescribeType(T{}));
}

}  // namespace semblance
