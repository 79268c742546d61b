// SPDX-License-Identifier: GPL-3.0-or-later
// A parsed document as a plain tree that remembers where each entry stands. Nothing in it knows the
// types that will be read from it, so base files, overrides and the axes of a study are edits of
// trees.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace semblance {

// Where a tree was read from.
struct ConfigSource {
  std::string name;              // the file as the user wrote it, or "--set a.b=c"
  std::filesystem::path folder;  // what relative paths in it are relative to
  int order = 0;                 // errors are listed source by source, in this order
  bool has_lines = true;         // false for an override, which has no line and column
};

// A location in a source, for messages. line and column count from 1; 0 where there is none.
struct ConfigLocation {
  std::shared_ptr<const ConfigSource> source;  // null for defaults, which stand in no file
  int line = 0;
  int column = 0;
};

// "file:3:7", "--set a.b=c" or "default".
std::string ToText(const ConfigLocation& location);

// An ordered tree of null, text, maps and lists. Keys are unique within a map.
struct ConfigNode {
  enum class Kind { kNull, kScalar, kMap, kList };
  struct Entry;

  Kind kind = Kind::kNull;
  std::string text;               // of a scalar, without its quotes
  bool quoted = false;            // a quoted scalar is a text, never a number or true
  ConfigLocation location;        // of a null in a map: that of its key
  std::vector<Entry> entries;     // of a map, in the order of the file
  std::vector<ConfigNode> items;  // of a list

  static ConfigNode Scalar(std::string text);
  static ConfigNode Quoted(std::string text);
  static ConfigNode Map();
  static ConfigNode List();

  bool IsNull() const { return kind == Kind::kNull; }
  bool IsScalar() const { return kind == Kind::kScalar; }
  bool IsMap() const { return kind == Kind::kMap; }
  bool IsList() const { return kind == Kind::kList; }

  // The value under `key`, or null pointer. Only maps have any.
  const ConfigNode* Find(std::string_view key) const;
  ConfigNode* Find(std::string_view key);
  // Adds or replaces the value under `key`; the node must be a map.
  ConfigNode& Set(std::string_view key, ConfigNode value);

 private:
  static ConfigNode OfKind(Kind kind);
};

struct ConfigNode::Entry {
  std::string key;
  ConfigLocation key_location;
  ConfigNode value;
};

// Here, where an entry is a whole type.
inline ConfigNode ConfigNode::Map() { return OfKind(Kind::kMap); }
inline ConfigNode ConfigNode::List() { return OfKind(Kind::kList); }

// A map in the order of the file that remembers where its keys stand: a field for option paths and
// other keys whose order or location matters.
template <class T>
struct ConfigMap {
  struct Entry {
    std::string key;
    ConfigLocation key_location;
    T value;
  };
  std::vector<Entry> entries;
};

// `over` laid over `base`: maps merge key by key, all else replaces. A map whose `type` differs
// from the one in `base` replaces it wholly; a map without `type` over the bare name of a type
// gives options to that type.
ConfigNode MergeTrees(ConfigNode base, const ConfigNode& over);

// Where the entry at `path` ("a.b[0].c") stands; where the tree does not hold it, the last entry on
// the way to it.
ConfigLocation LocationOf(const ConfigNode& tree, std::string_view path);

// Sets the entry at `path` ("a.b[0].c"; an index counts from 0) to `value`, merging as MergeTrees
// does. Maps on the way are made where they are missing; a list must have the item already.
// A new `type` of a variant drops what other layers (files, all overrides together) say of it.
// `defaults`, where given, is the tree of the default values: an entry that the path goes through
// and `tree` lacks starts as a copy of the default, so that an item of a default list can be set.
// Throws ConfigError ("a.b: what") if the path is malformed or leads nowhere.
void SetPath(ConfigNode& tree, std::string_view path, const ConfigNode& value,
             const ConfigNode* defaults = nullptr);

}  // namespace semblance
