// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/named_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

std::map<std::string, double> ToMap(const NamedNumbers& numbers) {
  return {numbers.begin(), numbers.end()};
}

// After any sequence of assignments the numbers equal those of a map.
TEST(NamedNumbers, BehaveAsAMap) {
  Random random(1);
  NamedNumbers numbers;
  std::map<std::string, double> map;
  for (int n = 0; n < 300; ++n) {
    const std::string name = std::to_string(random.Index(100));
    map[name] += n;
    numbers[name] += n;
    const std::string other = std::to_string(random.Index(100));
    EXPECT_EQ(numbers.contains(other), map.contains(other));
    const auto next = map.lower_bound(other);
    EXPECT_EQ(numbers.lower_bound(other) == numbers.end(), next == map.end());
    if (next != map.end()) {
      EXPECT_EQ(numbers.lower_bound(other)->first, next->first);
    }
  }
  EXPECT_EQ(ToMap(numbers), map);
  EXPECT_EQ(numbers.size(), map.size());
}

TEST(NamedNumbers, AChangeLeavesThoseThatShareTheNames) {
  const auto names =
      std::make_shared<const std::vector<std::string>>(std::vector<std::string>{"b"});
  NamedNumbers one(names, {1}), other(names, {2});
  one["a"] = 3;
  EXPECT_EQ(ToMap(one), (std::map<std::string, double>{{"a", 3}, {"b", 1}}));
  EXPECT_EQ(ToMap(other), (std::map<std::string, double>{{"b", 2}}));
  EXPECT_THROW(other.at("a"), std::out_of_range);
}

}  // namespace
}  // namespace semblance::problems
