// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of points as programs write them, at the speed at which numbers can be read.
#pragma once

#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include "problems/points/point_table.h"

namespace semblance {

// Lines of bare decimal numbers with commas between them, in the order of the columns. What is
// anything else (blanks, quotes, a plus sign, a number that is not finite, too many or too few) is
// left to ParsePointTable, which takes what it may and says what is wrong with the rest.
class PlainPoints {
 public:
  // columns: of a line, what each is.
  explicit PlainPoints(PointColumns columns);

  // Whole lines; the last need not end. False if one is not plain: then nothing of what was added
  // can be relied on.
  bool Add(std::string_view lines);
  // Makes room for so many in all.
  void Reserve(std::size_t count);
  std::size_t size() const { return table_.positions.size(); }
  PointTable Take() { return std::move(table_); }

 private:
  bool AddLine(const char*& at, const char* end);
  bool AddPoint();
  bool AddExactness();

  PointColumns columns_;
  bool has_uv_ = false, has_weight_ = false, has_sigma_ = false, has_exact_ = false;
  std::vector<double> values_;  // of a line, by kind
  PointTable table_;
};

}  // namespace semblance
