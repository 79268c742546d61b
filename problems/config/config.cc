// SPDX-License-Identifier: GPL-3.0-or-later
// The only file that includes yaml-cpp. It handles the parser's events instead of loading
// YAML::Node, because a YAML::Node no longer shows repeated keys, anchors and tags.
#include "problems/config/config.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <span>
#include <sstream>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/config/utf8_check.h"
#include "surfaces/base/atomic_file.h"

namespace semblance::problems {
namespace {

using SourcePtr = std::shared_ptr<const ConfigSource>;

ConfigLocation LocationAt(const SourcePtr& source, const YAML::Mark& mark) {
  return {source, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1};
}

// Placeholder for an unreadable text. Missing keys are reported at its start.
ConfigNode EmptyMap(const SourcePtr& source) {
  ConfigNode map = ConfigNode::Map();
  map.location = {source, 1, 1};
  return map;
}

ConfigLocation EndLocation(std::string_view text, const SourcePtr& source) {
  const auto lines = std::count(text.begin(), text.end(), '\n');
  const std::size_t last_break = text.rfind('\n');
  const std::size_t line_begin = last_break == text.npos ? 0 : last_break + 1;
  return {source, static_cast<int>(lines) + 1, static_cast<int>(text.size() - line_begin) + 1};
}

// Splits a text into lines as the parser counts them: from 0, without a byte order mark.
std::vector<std::string_view> SplitLines(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) {
    text.remove_prefix(kByteOrderMark.size());
  }
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

// The rest of the line from `mark` on.
std::string_view LineFrom(std::span<const std::string_view> lines, const YAML::Mark& mark) {
  const auto line = static_cast<std::size_t>(std::max(mark.line, 0));
  const std::string_view text = line < lines.size() ? lines[line] : std::string_view();
  return text.substr(std::min<std::size_t>(std::max(mark.column, 0), text.size()));
}

// Returns true if `quote`, which is open at the start of `rest`, is closed in it.
bool ClosesQuote(std::string_view rest, char quote) {
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const bool escapes = quote == '"' && rest[k] == '\\';  // the next character closes nothing
    const bool is_doubled = quote == '\'' && rest.substr(k).starts_with("''");
    if (escapes || is_doubled) {
      ++k;
    } else if (rest[k] == quote) {
      return true;
    }
  }
  return false;
}

// The number of blanks before the first other character of a line; nothing for an empty line.
std::optional<std::size_t> Indent(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \r");
  return first == line.npos ? std::nullopt : std::optional(first);
}

// Builds the tree of the first document. Adds an error for everything that a tree cannot represent.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::string_view text, SourcePtr source, ConfigErrors& errors)
      : lines_(SplitLines(text)), source_(std::move(source)), errors_(errors) {
    root_.location = {source_, 1, 1};
  }

  ConfigNode TakeRoot() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    ++documents_;
    if (documents_ == 2) {
      errors_.Add(LocationAt(source_, mark), "", "a second document begins here; a file holds one");
    }
  }
  void OnDocumentEnd() override {}

  void OnAnchor(const YAML::Mark& mark, const std::string& name) override {
    AddError(mark,
             fmt::format("anchors (&{}) are not read; repeat the entries or use base:", name));
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    AddError(mark, "aliases (*) are not read; repeat the entries or use base:");
    SkipNode();
  }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { Add(At(mark)); }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& value) override {
    RefuseSeveralLines(mark, value);
    ConfigNode node = At(mark);
    node.kind = ConfigNode::Kind::kScalar;
    node.text = value;
    node.quoted = tag == "!";
    if (tag != "!") {
      RefuseTag(mark, tag);
    }
    Add(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                       YAML::EmitterStyle::value style) override {
    Open(mark, tag, ConfigNode::Kind::kList, style);
  }
  void OnSequenceEnd() override { Close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                  YAML::EmitterStyle::value style) override {
    Open(mark, tag, ConfigNode::Kind::kMap, style);
  }
  void OnMapEnd() override { Close(); }

 private:
  // A map or list that is still open, and for a map the key whose value comes next.
  struct Level {
    ConfigNode node;
    bool is_flow = false;
    int keys = 0;  // keys read so far, valid or not
    bool has_key = false;
    bool is_key_good = false;
    std::string key = {};
    ConfigLocation key_location = {};
  };

  ConfigNode At(const YAML::Mark& mark) const {
    ConfigNode node;
    node.location = LocationAt(source_, mark);
    return node;
  }

  std::string Path() const {
    std::string path;
    for (const Level& level : levels_) {
      if (level.node.IsList()) {
        path = JoinPath(path, level.node.items.size());
      } else if (level.has_key) {
        path = JoinPath(path, level.key);
      }
    }
    return path;
  }

  void AddError(const YAML::Mark& mark, std::string_view what) {
    if (documents_ <= 1) {
      errors_.Add(LocationAt(source_, mark), Path(), what);
    }
  }

  void RefuseTag(const YAML::Mark& mark, const std::string& tag) {
    if (tag != "?" && !tag.empty()) {
      AddError(mark, fmt::format("tags ({}) are not read; remove it", tag));
    }
  }

  // Refuses a text that continues on the next line and looks like a mistake: a quote or a bracket
  // that was not closed would swallow the options that follow. Programs that fold long texts indent
  // the next lines deeper than the line of the text's key, and fold no short lines.
  void RefuseSeveralLines(const YAML::Mark& mark, const std::string& value) {
    constexpr std::size_t kFolded = 80;  // columns; PyYAML folds a text after them
    const std::string_view line = LineFrom(lines_, mark);
    const bool is_quoted = line.starts_with('"') || line.starts_with('\'');
    const bool is_flow = !levels_.empty() && levels_.back().is_flow;
    if (is_quoted && !ClosesQuote(line.substr(1), line.front()) && !IsFoldedQuote(mark)) {
      AddError(mark,
               "the quote that begins here is not closed in its line; close it (write a text of "
               "several lines as a block, after |, or indent its next lines deeper)");
    } else if (!is_quoted && is_flow && !line.starts_with(value) &&
               static_cast<std::size_t>(std::max(mark.column, 0)) + line.size() < kFolded) {
      AddError(mark,
               "a text within brackets continues on the next line; is a comma or a bracket "
               "missing?");
    }
  }

  // Returns true if the lines after `mark`, up to the one that closes its quote, are indented
  // deeper than the line of `mark`. Empty lines are allowed between them.
  bool IsFoldedQuote(const YAML::Mark& mark) const {
    const auto first = static_cast<std::size_t>(std::max(mark.line, 0));
    if (first >= lines_.size()) {
      return false;
    }
    const char quote = LineFrom(lines_, mark).front();
    // "- " before a key or a text is not part of its indent.
    const std::string_view line = lines_[first];
    const std::size_t indent = std::min(line.find_first_not_of(" -"), line.size());
    const std::size_t least = LineFrom(lines_, mark).size() == line.size() - indent
                                  ? Indent(line).value_or(0)  // an item of a list
                                  : indent;
    for (std::size_t k = first + 1; k < lines_.size(); ++k) {
      if (const auto next = Indent(lines_[k]); next && *next <= least) {
        return false;
      }
      if (ClosesQuote(lines_[k], quote)) {
        return true;
      }
    }
    return false;
  }

  void Open(const YAML::Mark& mark, const std::string& tag, ConfigNode::Kind kind,
            YAML::EmitterStyle::value style) {
    if (levels_.size() >= kMaxConfigDepth) {
      throw YAML::Exception(
          mark, fmt::format("more than {} levels of nested maps and lists", kMaxConfigDepth));
    }
    RefuseTag(mark, tag);
    levels_.push_back({.node = At(mark), .is_flow = style == YAML::EmitterStyle::Flow});
    levels_.back().node.kind = kind;
  }

  void Close() {
    ConfigNode node = std::move(levels_.back().node);
    levels_.pop_back();
    Add(std::move(node));
  }

  void Add(ConfigNode node) {
    if (levels_.empty()) {
      if (documents_ <= 1) {
        root_ = std::move(node);
      }
      return;
    }
    Level& level = levels_.back();
    if (level.node.IsList()) {
      level.node.items.push_back(std::move(node));
    } else if (!level.has_key) {
      TakeKey(level, node);
    } else {
      AddEntry(level, std::move(node));
    }
  }

  // Drops a node that already has an error: a key with its value, a value with its key, or an item
  // of a list.
  void SkipNode() {
    if (!levels_.empty() && levels_.back().node.IsMap()) {
      levels_.back().has_key = !levels_.back().has_key;
      levels_.back().is_key_good = false;
    }
  }

  void TakeKey(Level& level, const ConfigNode& node) {
    if (++level.keys > kMaxKeys) {
      YAML::Mark mark;
      mark.line = node.location.line - 1;
      mark.column = node.location.column - 1;
      throw YAML::Exception(mark, fmt::format("more than {} entries in one map", kMaxKeys));
    }
    level.is_key_good = node.IsScalar();
    level.key = Normalized(node.text);
    level.key_location = node.location;
    std::string what;
    if (!node.IsScalar()) {
      what = "a key must be a word";
    } else if (node.text == "<<" && !node.quoted) {
      what = "merge keys (<<) are not read; repeat the entries or use base:";
    } else if (const ConfigLocation* first = FindKey(level.node, level.key)) {
      what = fmt::format("the key appears twice; first at line {}, column {}", first->line,
                         first->column);
    }
    if (!what.empty()) {
      level.is_key_good = false;
      if (documents_ <= 1) {
        errors_.Add(node.location, node.IsScalar() ? JoinPath(Path(), node.text) : Path(), what);
      }
    }
    level.has_key = true;
  }

  static const ConfigLocation* FindKey(const ConfigNode& map, const std::string& key) {
    for (const ConfigNode::Entry& entry : map.entries) {
      if (entry.key == key) {
        return &entry.key_location;
      }
    }
    return nullptr;
  }

  static void AddEntry(Level& level, ConfigNode value) {
    level.has_key = false;
    if (!level.is_key_good) {
      return;
    }
    if (value.IsNull()) {
      value.location = level.key_location;  // yaml-cpp gives a null the location of the next entry
    }
    level.node.entries.push_back({level.key, level.key_location, std::move(value)});
  }

  std::vector<std::string_view> lines_;
  SourcePtr source_;
  ConfigErrors& errors_;
  ConfigNode root_;
  std::vector<Level> levels_;
  int documents_ = 0;
};

// The state of one load: the files read so far, to find cycles and to order the errors.
struct Loading {
  ConfigErrors& errors;
  int next_order = 0;                             // number of files read
  std::vector<std::filesystem::path> chain = {};  // canonical paths of the files above this one
};

ConfigNode LoadDocument(std::string_view text, const std::filesystem::path& file, Loading& loading);

ConfigNode LoadBase(const ConfigNode& base, const std::filesystem::path& file, Loading& loading) {
  const auto fail = [&](const std::string& what) {
    loading.errors.Add(base.location, "base", what);
    return ConfigNode::Map();
  };
  if (!base.IsScalar() || base.text.empty()) {
    return fail("expected the path of a file");
  }
  const std::filesystem::path base_file = (file.parent_path() / base.text).lexically_normal();
  std::error_code none;  // ignored: a path that has no canonical form cannot be read below either
  const auto canonical = std::filesystem::weakly_canonical(base_file, none);
  if (std::find(loading.chain.begin(), loading.chain.end(), canonical) != loading.chain.end()) {
    return fail(fmt::format("'{}' would be its own base", base.text));
  }
  if (loading.next_order > static_cast<int>(kMaxConfigDepth)) {
    return fail(fmt::format("more than {} bases, including bases of bases", kMaxConfigDepth));
  }
  std::string text;
  try {
    text = ReadFileBytes(base_file);
  } catch (const IoError& e) {
    return fail(fmt::format("{}; paths are relative to this file", e.what()));
  }
  return LoadDocument(text, base_file, loading);
}

// Loads one base, or a list of bases, each merged over those before it.
ConfigNode LoadBases(const ConfigNode& bases, const std::filesystem::path& file, Loading& loading) {
  if (!bases.IsList() || bases.items.empty()) {
    return LoadBase(bases, file, loading);
  }
  ConfigNode tree = ConfigNode::Map();
  for (const ConfigNode& base : bases.items) {
    tree = MergeTrees(std::move(tree), LoadBase(base, file, loading));
  }
  return tree;
}

ConfigNode LoadDocument(std::string_view text, const std::filesystem::path& file,
                        Loading& loading) {
  const ConfigSource source{.name = file.string(),
                            .folder = std::filesystem::absolute(file).parent_path(),
                            .order = loading.next_order++};
  ConfigNode tree = ParseConfigText(text, source, loading.errors);
  if (tree.IsNull()) {
    tree.kind = ConfigNode::Kind::kMap;
  } else if (!tree.IsMap()) {
    loading.errors.Add(tree.location, "",
                       fmt::format("expected a map of options at the top, found {}",
                                   tree.IsList() ? "a list" : "a scalar"));
    return EmptyMap(tree.location.source);
  }
  const auto entry = std::find_if(tree.entries.begin(), tree.entries.end(),
                                  [](const auto& candidate) { return candidate.key == "base"; });
  if (entry == tree.entries.end()) {
    return tree;
  }
  const ConfigNode bases = std::move(entry->value);
  tree.entries.erase(entry);
  loading.chain.push_back(std::filesystem::weakly_canonical(file));
  ConfigNode below = LoadBases(bases, file, loading);
  loading.chain.pop_back();
  return MergeTrees(std::move(below), tree);
}

// Applies one override to `tree`. `order` sorts its errors among those of other sources.
void ApplyOverride(std::string_view override_text, int order, const ConfigNode& defaults,
                   ConfigNode& tree, ConfigErrors& errors) {
  const ConfigSource source{.name = fmt::format("--set {}", override_text),
                            .folder = std::filesystem::current_path(),
                            .order = order,
                            .has_lines = false};
  const std::size_t equals = override_text.find('=');
  const std::size_t errors_before = errors.size();
  const ConfigLocation location{std::make_shared<const ConfigSource>(source)};
  if (equals == override_text.npos) {
    errors.Add(location, "", "an override is written as path=value");
    return;
  }
  const ConfigNode value = ParseConfigText(override_text.substr(equals + 1), source, errors);
  if (errors.size() > errors_before) {
    return;
  }
  try {
    SetPath(tree, override_text.substr(0, equals), value, &defaults);
  } catch (const ConfigError& error) {
    errors.Add(location, "", error.what());
  }
}

}  // namespace

ConfigNode ParseConfigText(std::string_view text, const ConfigSource& source,
                           ConfigErrors& errors) {
  const auto shared_source = std::make_shared<const ConfigSource>(source);
  if (text.size() > kMaxConfig_bytes) {
    errors.Add({shared_source, 1, 1}, "",
               fmt::format("{} MB of YAML; at most 16 MB are read", text.size() / 1'000'000));
    return EmptyMap(shared_source);
  }
  if (!RequireReadableBytes(text, shared_source, errors)) {
    return EmptyMap(shared_source);
  }
  std::istringstream stream{std::string(text)};
  TreeBuilder builder(text, shared_source, errors);
  try {
    YAML::Parser parser(stream);
    // The second call reports a second document.
    if (parser.HandleNextDocument(builder)) {
      parser.HandleNextDocument(builder);
    }
  } catch (const YAML::Exception& error) {
    // yaml-cpp has no location for a text that ends too early.
    const bool is_at_end = error.msg.starts_with("end of ");
    errors.Add(is_at_end ? EndLocation(text, shared_source) : LocationAt(shared_source, error.mark),
               "", fmt::format("this is not YAML: {}", error.msg));
    return EmptyMap(shared_source);
  }
  return builder.TakeRoot();
}

ConfigNode LoadConfigTextTree(std::string_view text, const std::filesystem::path& pretend_file,
                              std::span<const std::string> overrides, const ConfigNode& defaults,
                              ConfigErrors& errors) {
  Loading loading{.errors = errors};
  ConfigNode tree = LoadDocument(text, pretend_file, loading);
  for (const std::string& override_text : overrides) {
    ApplyOverride(override_text, loading.next_order++, defaults, tree, errors);
  }
  return tree;
}

ConfigNode LoadConfigTree(const std::filesystem::path& file, std::span<const std::string> overrides,
                          const ConfigNode& defaults, ConfigErrors& errors) {
  return LoadConfigTextTree(ReadFileBytes(file), file, overrides, defaults, errors);
}

int CommonKeys(const ConfigNode& a, const ConfigNode& b) {
  return static_cast<int>(
      std::count_if(a.entries.begin(), a.entries.end(),
                    [&](const ConfigNode::Entry& entry) { return b.Find(entry.key) != nullptr; }));
}

}  // namespace semblance::problems
