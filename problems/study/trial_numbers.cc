// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_numbers.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/json_text.h"

namespace semblance {
namespace {

using Json = nlohmann::json;

// Follows the text of a trial.json; false ends the reading.
class TrialHandler : public nlohmann::json_sax<Json> {
 public:
  TrialNumbers Take() { return std::move(trial_); }

  bool null() override { return lists_open_ > 0 ? Number(kNaN) : IsInObject() && IsNoText(); }
  bool boolean(bool) override { return IsInObject() && IsNoText(); }
  bool number_integer(number_integer_t value) override {
    return Number(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return Number(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return Number(value); }
  bool binary(binary_t&) override { return false; }

  bool string(string_t& value) override {
    if (std::string* head = Head()) {
      *head = std::move(value);
    }
    return IsInObject();
  }
  bool key(string_t& name) override {
    path_.resize(path_lengths_.back());
    path_ += (path_.empty() ? "" : ".") + name;
    return true;
  }

  bool start_object(std::size_t) override {
    const bool is_taken = IsNoText();
    path_lengths_.push_back(path_.size());
    return is_taken;
  }
  bool end_object() override { return End(); }
  bool start_array(std::size_t) override {
    ++lists_open_;
    const bool is_taken = IsInObject() && IsNoText();
    path_lengths_.push_back(path_.size());
    return is_taken;
  }
  bool end_array() override {
    --lists_open_;
    return End();
  }

  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

 private:
  // Where the text goes that follows; null if it is kept nowhere.
  std::string* Head() {
    return path_lengths_.size() != 1 ? nullptr
           : path_ == "id"           ? &trial_.id
           : path_ == "status"       ? &trial_.status
           : path_ == "reason"       ? &trial_.reason
                                     : nullptr;
  }
  bool IsInObject() const { return !path_lengths_.empty(); }  // a trial.json is one itself
  bool IsNoText() { return Head() == nullptr; }

  bool Number(double value) {
    constexpr std::string_view kResult = "result.";
    if (path_.starts_with(kResult)) {
      if (lists_open_ > 0) {
        trial_.lists[path_.substr(kResult.size())].push_back(value);
      } else {
        trial_.metrics[path_.substr(kResult.size())] = value;
      }
    }
    return IsInObject() && IsNoText();
  }

  bool End() {
    path_.resize(path_lengths_.back());
    path_lengths_.pop_back();
    return true;
  }

  TrialNumbers trial_;
  std::string path_;                       // of the value that follows
  std::vector<std::size_t> path_lengths_;  // where each open list or object began
  int lists_open_ = 0;
};

}  // namespace

std::optional<TrialNumbers> ReadTrialNumbers(std::string_view text) {
  try {
    CheckJsonDepth(text);
  } catch (const IoError&) {
    return std::nullopt;
  }
  TrialHandler handler;
  return Json::sax_parse(text, &handler) ? std::optional(handler.Take()) : std::nullopt;
}

}  // namespace semblance
