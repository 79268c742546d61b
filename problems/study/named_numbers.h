// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers by name, as a trial has them: a map that takes 8 bytes per number, because trials with
// the same names share one list of names. A study has up to 100,000 trials with hundreds of
// numbers each.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace semblance::problems {

class NamedNumbers {
 public:
  using Entry = std::pair<const std::string&, double>;

  // Walks through the entries in the order of their names.
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Entry;
    using difference_type = std::ptrdiff_t;
    using reference = Entry;
    struct pointer {
      Entry entry;
      const Entry* operator->() const { return &entry; }
    };

    Iterator() = default;
    Iterator(const NamedNumbers& numbers, std::size_t at) : numbers_(&numbers), at_(at) {}
    Entry operator*() const { return {(*numbers_->names_)[at_], numbers_->values_[at_]}; }
    pointer operator->() const { return {**this}; }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    Iterator operator++(int) { return {*numbers_, at_++}; }
    bool operator==(const Iterator& other) const { return at_ == other.at_; }

   private:
    const NamedNumbers* numbers_ = nullptr;
    std::size_t at_ = 0;
  };
  using const_iterator = Iterator;

  NamedNumbers() = default;
  NamedNumbers(std::initializer_list<std::pair<std::string, double>> entries);
  // Takes names that are sorted and differ, and one value for each.
  NamedNumbers(std::shared_ptr<const std::vector<std::string>> names, std::vector<double> values);

  std::size_t size() const { return values_.size(); }
  bool empty() const { return values_.empty(); }
  void clear() { *this = {}; }

  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, values_.size()}; }
  // Finds the first entry whose name is not less than `name`.
  Iterator lower_bound(std::string_view name) const { return {*this, Position(name)}; }
  Iterator find(std::string_view name) const;
  bool contains(std::string_view name) const { return find(name) != end(); }
  // Throws std::out_of_range if there is no such number.
  double at(std::string_view name) const;
  // Adds the number 0 if there is none of this name. Other rows keep their names.
  double& operator[](std::string_view name);

  // The sorted names, which rows of the same names share; null if there is none.
  const std::vector<std::string>* names() const { return names_.get(); }

 private:
  std::size_t Position(std::string_view name) const;

  std::shared_ptr<const std::vector<std::string>> names_;
  std::vector<double> values_;
};

}  // namespace semblance::problems
