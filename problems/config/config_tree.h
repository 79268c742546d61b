// SPDX-License-Identifier: GPL-3.0-or-later
// A parsed document as a plain tree that remembers the location of each entry, the errors found in
// it, and the tree as YAML text. The tree is independent of the types that are read from it, so
// base files, overrides and the axes of a study are edits of trees.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace semblance::problems {

// Limits against hostile files, far above what real files need. They bound recursion, which must
// fit the stack: levels of nested maps and lists, steps of a path, and bases including their own
// bases.
inline constexpr std::size_t kMaxConfigDepth = 64;
// Keys of one map. The search for a key is linear, so many keys would take quadratic time.
inline constexpr int kMaxKeys = 10'000;
inline constexpr std::size_t kMaxConfig_bytes = 16'000'000;

// The file or override that a tree was read from.
struct ConfigSource {
  std::string name;              // the file as the user wrote it, or "--set a.b=c"
  std::filesystem::path folder;  // base of the relative paths in it
  int order = 0;                 // position among the sources when errors are listed
  bool has_lines = true;         // false for an override, which has no line and column
};

// A location in a source, for messages. Lines and columns count from 1; 0 means none.
struct ConfigLocation {
  std::shared_ptr<const ConfigSource> source;  // null for defaults, which are in no file
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
  std::string text;               // a scalar's text, without its quotes
  bool quoted = false;            // a quoted scalar is a text, never a number or boolean
  ConfigLocation location;        // a null in a map has the location of its key
  std::vector<Entry> entries;     // a map's entries, in the order of the file
  std::vector<ConfigNode> items;  // a list's items

  static ConfigNode Scalar(std::string text);
  static ConfigNode Quoted(std::string text);
  static ConfigNode Map();
  static ConfigNode List();

  bool IsNull() const { return kind == Kind::kNull; }
  bool IsScalar() const { return kind == Kind::kScalar; }
  bool IsMap() const { return kind == Kind::kMap; }
  bool IsList() const { return kind == Kind::kList; }

  // Returns the value under `key`, or nullptr if there is none or the node is not a map.
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

// Defined here because Entry must be complete.
inline ConfigNode ConfigNode::Map() { return OfKind(Kind::kMap); }
inline ConfigNode ConfigNode::List() { return OfKind(Kind::kList); }

// A map that keeps the order of the file and the location of each key, for fields whose keys are
// option paths, or whose order or location matters.
template <class T>
struct ConfigMap {
  struct Entry {
    std::string key;
    ConfigLocation key_location;
    T value;
  };
  std::vector<Entry> entries;
};

// Merges `over` over `base`: maps merge key by key, anything else replaces. A map whose `type`
// differs from that of `base` replaces `base` wholly. A map without `type` over the bare name of a
// type sets options of that type.
ConfigNode MergeTrees(ConfigNode base, const ConfigNode& over);

// Joins the path of a parent with a key ("a.b", or "b" at the top) or an index ("a[3]").
std::string JoinPath(std::string_view parent, std::string_view key);
std::string JoinPath(std::string_view parent, std::size_t index);

// Returns the location of the entry at `path` ("a.b[0].c"), or, if the tree lacks the entry, the
// location of the last existing entry on the way to it.
ConfigLocation FindLocation(const ConfigNode& tree, std::string_view path);

// Sets the entry at `path` ("a.b[0].c"; indices count from 0) to `value`, merging as MergeTrees
// does. Missing maps on the way are created; a list must already have the item. A new `type` of a
// variant drops the options that other layers set in it; each file is a layer, and all overrides
// together are one. `defaults`, if given, is the tree of the default values: an entry on the way
// that `tree` lacks starts as a copy of its default, so that an item of a default list can be set.
// Throws ConfigError ("a.b: what") if the path is malformed or leads nowhere, and then changes
// nothing.
void SetPath(ConfigNode& tree, std::string_view path, const ConfigNode& value,
             const ConfigNode* defaults = nullptr);

// Writes a path in its one form: "a.b[00]" is "a.b[0]". Throws ConfigError if it is malformed.
std::string CanonicalPath(std::string_view path);

// Returns true if `value` at `path` sets the entry at `inner` too, a path within it, or the same
// one. The bare name of a variant's type sets its `type`; null sets everything. Both paths are
// canonical.
bool SetsEntry(std::string_view path, const ConfigNode& value, std::string_view inner);

// An error at a path, worded as for ConfigErrors::Add.
struct OptionFault {
  std::string path, what;
};

// An error with its location.
struct ConfigFault {
  ConfigLocation location;
  std::string path, what;
};

// Collects all errors of a configuration, so that the user sees them together.
class ConfigErrors {
 public:
  // `path` is the path of the entry ("a.b[0].c"), empty for the whole document. `what` is one or
  // more clauses, with the remedy.
  void Add(const ConfigLocation& location, std::string_view path, std::string_view what);
  std::size_t size() const { return faults_.size(); }
  const std::vector<ConfigFault>& faults() const { return faults_; }
  // Throws ConfigError with one line per error, sorted by source, line and column. Does nothing if
  // there is no error.
  void ThrowIfAny() const;

 private:
  std::vector<ConfigFault> faults_;
};

// Writes a tree as YAML text that the strict reader reads back, in block style with one line per
// entry. Throws InputError if a number is not finite.
std::string ToYaml(const ConfigNode& tree);

// Writes a tree on one line: {a: 1, b: [2, 3]}. Numbers that are not finite are allowed.
std::string ToFlowYaml(const ConfigNode& tree);

}  // namespace semblance::problems
