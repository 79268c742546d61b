// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_numbers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <system_error>

#include "problems/config/utf8_check.h"
#include "surfaces/base/json_text.h"

namespace semblance::problems {
namespace {

constexpr char kPathEnd = '\n';

// Splits a text whose parts each end in kPathEnd.
std::vector<std::string_view> SplitPaths(std::string_view paths) {
  std::vector<std::string_view> parts;
  while (!paths.empty()) {
    const std::size_t end = paths.find(kPathEnd);
    parts.push_back(paths.substr(0, end));
    paths.remove_prefix(end + 1);
  }
  return parts;
}

// Reads JSON once from its start to its end. Functions return false where the text is not JSON or
// not a trial.
class TrialScanner {
 public:
  explicit TrialScanner(std::string_view text) : text_(text) {}

  bool Read() {
    SkipBlanks();
    const bool is_object = Take('{') && ReadObject();
    SkipBlanks();
    return is_object && at_ == text_.size();
  }

  TrialNumbers TakeTrial(SharedNames& names) {
    trial_.metrics = names.Name(paths_, values_);
    return std::move(trial_);
  }

 private:
  void SkipBlanks() {
    while (IsAt(' ') || IsAt('\n') || IsAt('\r') || IsAt('\t')) {
      ++at_;
    }
  }

  bool IsAt(char c) const { return at_ < text_.size() && text_[at_] == c; }

  bool Take(char c) {
    const bool is_there = IsAt(c);
    at_ += is_there ? 1 : 0;
    return is_there;
  }

  bool TakeWord(std::string_view word) {
    const bool is_there = text_.substr(at_, word.size()) == word;
    at_ += is_there ? word.size() : 0;
    return is_there;
  }

  bool ReadValue() {
    SkipBlanks();
    if (IsAt('"')) {
      std::string value;
      return ReadText(value) && KeepText(std::move(value));
    }
    if (FindTextPlace() != nullptr) {
      return false;  // it must be a text
    }
    if (Take('{')) {
      return ReadObject();
    }
    if (Take('[')) {
      return ReadList();
    }
    if (TakeWord("null")) {
      return lists_open_ == 0 || KeepNumber(kNaN);
    }
    return TakeWord("true") || TakeWord("false") || ReadNumber();
  }

  // Reads the rest of an object after its brace.
  bool ReadObject() {
    constexpr int kMostEntries = 4000;  // as CheckJsonDepth
    const std::size_t length = path_.size();
    if (++depth_ > kDeepestJson) {
      return false;
    }
    SkipBlanks();
    int entries = 0;
    for (bool more = !Take('}'); more; more = Take(',')) {
      if (++entries > kMostEntries || !ReadEntry(length)) {
        return false;
      }
    }
    path_.resize(length);
    --depth_;
    return entries == 0 || Take('}');
  }

  // Reads a key and its value. `length` is that of the object's path.
  bool ReadEntry(std::size_t length) {
    std::string key;
    SkipBlanks();
    if (!IsAt('"') || !ReadText(key) || key.find(kPathEnd) != key.npos) {
      return false;
    }
    path_.resize(length);
    path_ += (path_.empty() ? "" : ".") + key;
    SkipBlanks();
    if (!Take(':') || !ReadValue()) {
      return false;
    }
    SkipBlanks();
    return true;
  }

  // Reads the rest of a list after its bracket.
  bool ReadList() {
    const std::size_t length = path_.size();
    ++lists_open_;
    if (++depth_ > kDeepestJson) {
      return false;
    }
    SkipBlanks();
    bool is_empty = true;
    for (bool more = !Take(']'); more; more = Take(',')) {
      is_empty = false;
      path_.resize(length);
      if (!ReadValue()) {
        return false;
      }
      SkipBlanks();
    }
    path_.resize(length);
    --depth_;
    --lists_open_;
    return is_empty || Take(']');
  }

  // Reads a text with its quotes.
  bool ReadText(std::string& value) {
    const std::size_t begin = at_++;
    bool is_plain = true, is_ascii = true;
    for (; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      const auto c = static_cast<unsigned char>(text_[at_]);
      if (c < ' ') {
        return false;
      }
      is_ascii = is_ascii && c < 0x80;
      if (c == '\\') {
        is_plain = false;
        ++at_;
      }
    }
    if (!Take('"')) {
      return false;
    }
    const std::string_view quoted = text_.substr(begin, at_ - begin);
    if (is_plain) {
      value = quoted.substr(1, quoted.size() - 2);
      return is_ascii || !LineThatIsNotUtf8(value);
    }
    const auto decoded = nlohmann::json::parse(quoted, nullptr, /*allow_exceptions=*/false);
    value = decoded.is_string() ? decoded.get<std::string>() : "";
    return decoded.is_string();
  }

  bool TakeDigits() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9') {
      ++at_;
    }
    return at_ > begin;
  }

  bool TakeFraction() { return !Take('.') || TakeDigits(); }

  bool TakeExponent() {
    if (!Take('e') && !Take('E')) {
      return true;
    }
    if (!Take('+')) {
      Take('-');
    }
    return TakeDigits();
  }

  bool ReadNumber() {
    const std::size_t begin = at_;
    Take('-');
    const bool is_number = (Take('0') || TakeDigits()) && TakeFraction() && TakeExponent();
    double value = kNaN;
    const auto [end, fault] = std::from_chars(text_.data() + begin, text_.data() + at_, value);
    if (fault != std::errc()) {  // too large, or so small that it is 0
      value = std::strtod(std::string(text_.substr(begin, at_ - begin)).c_str(), nullptr);
    }
    return is_number && std::isfinite(value) && KeepNumber(value);
  }

  // Returns the place for the text at the current path if it must be one, else null.
  std::string* FindTextPlace() {
    return depth_ != 1          ? nullptr
           : path_ == "id"      ? &trial_.id
           : path_ == "status"  ? &trial_.status
           : path_ == "reason"  ? &trial_.reason
           : path_ == "version" ? &trial_.version
           : path_ == "program" ? &trial_.program
                                : nullptr;
  }

  bool KeepText(std::string value) {
    constexpr std::string_view kAxes = "axes.";
    if (std::string* place = FindTextPlace()) {
      *place = std::move(value);
    } else if (path_ == "subject") {
      trial_.subject = std::move(value);
    } else if (depth_ == 2 && path_.starts_with(kAxes)) {
      trial_.axes.emplace_back(path_.substr(kAxes.size()), std::move(value));
    } else if (path_ == "files.file") {
      trial_.files.emplace_back().name = std::move(value);
    } else if (path_ == "files.sha256" && !trial_.files.empty()) {
      trial_.files.back().sha256 = std::move(value);
    }
    return true;
  }

  bool KeepNumber(double value) {
    constexpr std::string_view kResult = "result.";
    if (!path_.starts_with(kResult)) {
      if (path_ == "files.bytes" && !trial_.files.empty()) {
        trial_.files.back().bytes = value;
      }
    } else if (lists_open_ > 0) {
      trial_.lists[path_.substr(kResult.size())].push_back(value);
    } else {
      paths_.append(path_, kResult.size()) += kPathEnd;
      values_.push_back(value);
    }
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string path_;  // of the current value
  int depth_ = 0;     // number of open lists and objects
  int lists_open_ = 0;
  TrialNumbers trial_;
  std::string paths_;  // of the numbers of `result` that are in no list
  std::vector<double> values_;
};

}  // namespace

SharedNames::Layout SharedNames::MakeLayout(std::string_view paths) const {
  const std::vector<std::string_view> all = SplitPaths(paths);
  std::vector<std::string> kept;
  for (const std::string_view path : all) {
    if (!is_kept_ || is_kept_(path)) {
      kept.emplace_back(path);
    }
  }
  std::ranges::sort(kept);
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  Layout layout;
  for (const std::string_view path : all) {
    const auto found = std::ranges::lower_bound(kept, path);
    const bool is_kept = found != kept.end() && *found == path;
    layout.places.push_back(is_kept ? static_cast<std::size_t>(found - kept.begin()) : kept.size());
  }
  layout.names = std::make_shared<const std::vector<std::string>>(std::move(kept));
  return layout;
}

std::shared_ptr<const SharedNames::Layout> SharedNames::FindLayout(const std::string& paths) {
  constexpr std::size_t kMostLayouts = 1000;  // a study has a few; a limit bounds the memory
  const std::lock_guard lock(mutex_);
  const auto known = layouts_.find(paths);
  if (known != layouts_.end()) {
    return known->second;
  }
  auto layout = std::make_shared<const Layout>(MakeLayout(paths));
  if (layouts_.size() < kMostLayouts) {
    layouts_.emplace(paths, layout);
  }
  return layout;
}

NamedNumbers SharedNames::Name(const std::string& paths, const std::vector<double>& values) {
  const std::shared_ptr<const Layout> layout = FindLayout(paths);
  std::vector<double> kept(layout->names->size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (layout->places[k] < kept.size()) {
      kept[layout->places[k]] = values[k];
    }
  }
  return {layout->names, std::move(kept)};
}

std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text, SharedNames& names) {
  TrialScanner scanner(text);
  return scanner.Read() ? std::optional(scanner.TakeTrial(names)) : std::nullopt;
}

}  // namespace semblance::problems
