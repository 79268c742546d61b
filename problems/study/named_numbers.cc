// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/named_numbers.h"

#include <algorithm>
#include <stdexcept>

namespace semblance::problems {

NamedNumbers::NamedNumbers(std::initializer_list<std::pair<std::string, double>> entries) {
  for (const auto& [name, value] : entries) {
    (*this)[name] = value;
  }
}

NamedNumbers::NamedNumbers(std::shared_ptr<const std::vector<std::string>> names,
                           std::vector<double> values)
    : names_(std::move(names)), values_(std::move(values)) {}

std::size_t NamedNumbers::Position(std::string_view name) const {
  return names_ == nullptr
             ? 0
             : static_cast<std::size_t>(std::ranges::lower_bound(*names_, name) - names_->begin());
}

NamedNumbers::Iterator NamedNumbers::find(std::string_view name) const {
  const std::size_t at = Position(name);
  return at < values_.size() && (*names_)[at] == name ? Iterator(*this, at) : end();
}

double NamedNumbers::at(std::string_view name) const {
  const Iterator found = find(name);
  if (found == end()) {
    throw std::out_of_range("there is no number " + std::string(name));
  }
  return found->second;
}

double& NamedNumbers::operator[](std::string_view name) {
  const std::size_t at = Position(name);
  if (!contains(name)) {
    auto names = names_ == nullptr ? std::vector<std::string>() : *names_;
    names.insert(names.begin() + static_cast<std::ptrdiff_t>(at), std::string(name));
    names_ = std::make_shared<const std::vector<std::string>>(std::move(names));
    values_.insert(values_.begin() + static_cast<std::ptrdiff_t>(at), 0.0);
  }
  return values_[at];
}

}  // namespace semblance::problems
