// SPDX-License-Identifier: GPL-3.0-or-later
// Strict configuration: YAML to option structs and back. Data files (tissue tables, landmarks,
// networks) are YAML files too, and the same strict reader reads them.
//
// From an option struct to a reader, a writer, a reference and a schema
// ---------------------------------------------------------------------
// A struct describes its options once, in its `Fields` list (surfaces/base/fields.h):
//
//     struct Flat {
//       static constexpr std::string_view kName = "flat";  // only for an alternative of a variant
//       double decay = 6;                                  // the default
//     };
//     template <class Visitor>
//     void Fields(Visitor& visit, Flat& o) {
//       visit(FieldInfo{.name = "decay", .min = 0.5, .max = 50, .doc = "..."}, o.decay);
//     }
//
// `Fields` calls the visitor once per field, with the name, range, unit and meaning of the field
// and a reference to its value. Each task is one visitor, so all of them agree on the same list:
//
//     YAML text                                              YAML text
//        | ParseConfigText (config.cc, yaml-cpp)                ^ ToYaml (config_tree.h)
//        v                                                      |
//     ConfigNode ----ReadValue----> option struct ----ToTree--> ConfigNode
//                                        |
//                                        +----DescribeType----> ConfigType
//                                                               ReferenceText, SchemaText, ...
//
//   1. ParseConfigText turns text into a ConfigNode: a tree of maps, lists and scalars that
//      remembers the file, line and column of each entry. It knows no option. `base:` files and
//      `--set` overrides are edits of this tree (MergeTrees, SetPath), made before any option is
//      read.
//   2. ReadValue (config_binder.h) looks up each field's name in the tree and reads the entry by
//      the C++ type of the field: a scalar directly (config_reader.h), which checks its range;
//      a struct, list, map or variant by recursion. Then it refuses the keys that no field has, and
//      calls CheckValue(report, struct), if the struct has one, for rules that involve several
//      fields. ReadConfigTree finally calls FaultsBetween(T), if there is one, for rules across
//      structs. Every fault goes to ConfigErrors; none ends the reading.
//   3. ToTree (config_binder.h) does the reverse: it writes every field, and numbers so that they
//      read back bit for bit. Its text is `resolved.yaml`, and the ids of trials are its hashes.
//   4. DescribeType (config_binder.h) collects names, types, defaults, ranges and meanings into a
//      ConfigType. options_reference.h prints it as text (`semblance options`), as JSON Schema for
//      editors, and as JSON values for the workbench.
//   5. NamedFiles (config_binder.h) collects all paths of a struct, for hashes and checks of input.
//
// A new option therefore needs one member and one line of `Fields`, and nothing else. The templates
// only dispatch on the type; the work is in functions without templates, so that a variant of many
// structs stays cheap to compile.
//
// Input that the reader accepts
// -----------------------------
// Every field may be left out and then keeps its default; an empty file means all defaults. The
// reader refuses everything else that is not exactly right: unknown and repeated keys, null where
// the field is not optional, quoted numbers, whole numbers written 1e3 or 1.0, numbers with a
// leading zero or in another base, nan and inf, yes/no/on/off, values out of range, anchors,
// aliases, tags, merge keys, tabs, a second document. It reports all errors together, one per line:
//     file:line:column: path: what; did you mean 'x'?
//
// `base: other.yaml` at the top lays the file over another one, and `base: [a.yaml, b.yaml]` lays
// it over b.yaml and that over a.yaml. Maps merge key by key; lists and scalars replace; a variant
// of another `type` replaces the whole variant. Bases may have bases. A path is relative to the
// file in which it is written.
//
// Overrides ("a.b[0].c=v", v in YAML) come last. Their errors begin with the override:
// `--set a.b=c: ...`. Paths in an override are relative to the current folder. An override can set
// an item of a default list or an option of a default variant. "a.type=b" replaces a variant of
// another type wholly, except for the options that other overrides set in it.
//
// A variant is written as a map with `type`, or as the bare name of a type, which gives that type
// its defaults. A map without `type` sets options of the field's default type; an item of a list
// must have `type`.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "problems/config/config_binder.h"
#include "problems/config/config_tree.h"
#include "problems/config/options_reference.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::problems {

// Parses one YAML text. Adds an error for everything that the tree cannot represent: repeated keys,
// anchors, tags and so on. Returns null for an empty text, and an empty map after a syntax error.
ConfigNode ParseConfigText(std::string_view text, const ConfigSource& source, ConfigErrors& errors);

// Parses a file, merges it over its bases and applies the overrides. `defaults` is the tree of the
// default values, which overrides may reach into. Throws IoError if the file cannot be read; a base
// that cannot be read is added to `errors`. LoadConfigTextTree does the same for a text, with paths
// relative to the folder of `pretend_file`, which need not exist.
ConfigNode LoadConfigTree(const std::filesystem::path& file, std::span<const std::string> overrides,
                          const ConfigNode& defaults, ConfigErrors& errors);
ConfigNode LoadConfigTextTree(std::string_view text, const std::filesystem::path& pretend_file,
                              std::span<const std::string> overrides, const ConfigNode& defaults,
                              ConfigErrors& errors);

// Returns the number of keys that both maps have.
int CommonKeys(const ConfigNode& a, const ConfigNode& b);

// Writes all fields into a tree, those with default values too.
template <class T>
ConfigNode MakeConfigTree(const T& value) {
  return config_internal::ToTree(value);
}

// Reads a value from a tree. Adds an error for each wrong entry, whose field keeps its default. If
// no entry is wrong and the type has FaultsBetween(T), adds the faults that it returns.
template <class T>
T ReadConfigTree(const ConfigNode& tree, ConfigErrors& errors) {
  T value{};
  const std::size_t errors_before = errors.size();
  config_internal::ReadValue(errors, {tree, "", FieldInfo{}}, value);
  if constexpr (requires { FaultsBetween(value); }) {
    if (errors.size() == errors_before) {
      for (const OptionFault& fault : FaultsBetween(value)) {
        errors.Add(FindLocation(tree, fault.path), fault.path, fault.what);
      }
    }
  }
  return value;
}

// Reads a file with its bases and overrides. Throws ConfigError with all errors, and IoError if the
// file cannot be read.
template <class T>
T ReadConfig(const std::filesystem::path& file, std::span<const std::string> overrides = {}) {
  ConfigErrors errors;
  const ConfigNode tree = LoadConfigTree(file, overrides, MakeConfigTree(T{}), errors);
  T value = ReadConfigTree<T>(tree, errors);
  errors.ThrowIfAny();
  return value;
}

// Counts the top keys of a file and its bases that are fields of T, to find out which kind of file
// it is. Returns 0 for a file that is not YAML. Throws IoError if the file cannot be read.
template <class T>
int KnownKeys(const std::filesystem::path& file) {
  ConfigErrors errors;
  const ConfigNode fields = MakeConfigTree(T{});
  return CommonKeys(LoadConfigTree(file, {}, fields, errors), fields);
}

// Counts the same without the bases, and without the key `base`, which any kind of file may have.
template <class T>
int OwnKeys(const std::filesystem::path& file) {
  ConfigErrors errors;
  const ConfigNode tree = ParseConfigText(
      ReadFileBytes(file), {.name = file.string(), .folder = file.parent_path()}, errors);
  ConfigNode fields = MakeConfigTree(T{});
  std::erase_if(fields.entries, [](const auto& entry) { return entry.key == "base"; });
  return CommonKeys(tree, fields);
}

// Does what ReadConfig does, for a text as if it were in `pretend_file`, which need not exist.
template <class T>
T ReadConfigText(std::string_view text, const std::filesystem::path& pretend_file,
                 std::span<const std::string> overrides = {}) {
  ConfigErrors errors;
  const ConfigNode tree =
      LoadConfigTextTree(text, pretend_file, overrides, MakeConfigTree(T{}), errors);
  T value = ReadConfigTree<T>(tree, errors);
  errors.ThrowIfAny();
  return value;
}

// Writes resolved YAML: every field explicitly, paths absolute. Reading it gives the same value bit
// for bit. Throws InputError if a number is not finite.
template <class T>
std::string WriteConfig(const T& value) {
  return ToYaml(MakeConfigTree(value));
}

// Describes each option for people: path, type, default, range, unit and meaning.
template <class T>
std::string OptionsReference() {
  return ReferenceText(config_internal::DescribeType(T{}));
}

// Describes each option for editors, as a JSON Schema (draft 2020-12).
template <class T>
std::string OptionsSchema() {
  return SchemaText(config_internal::DescribeType(T{}));
}

}  // namespace semblance::problems
