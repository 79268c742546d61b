// SPDX-License-Identifier: GPL-3.0-or-later
// Finds columns that were read as something else than their writer meant. Numbers alone cannot show
// such a mistake, but their pattern over all rows does.
#pragma once

#include <string_view>

#include "problems/points/point_table.h"

namespace semblance::problems {

// Throws IoError if the first of several unnamed columns counts the rows (1, 2, 3, ...) or seconds,
// so that it is no x. further: the number of columns after the third; without any, the first column
// may be a coordinate.
void RefuseRowNumbers(const PointTable& table, std::size_t further, std::string_view name);

// Throws IoError if commas or points in a column are separators of thousands: 12,345 beside 678. A
// decimal comma in every such place would have three digits behind it each time, and none in 678.
// separators: the characters between the entries.
void RefuseThousands(std::string_view rows, std::string_view separators, std::string_view name);

// Throws IoError if commas stand both between and within the numbers of unnamed columns: each row
// has six whole numbers, of which the second, fourth or sixth begins with 0, as in 37,074,44,5,1,2.
void RefuseCommasWithin(std::string_view rows, std::string_view name);

// Returns whether a row has commas within its entries, and blanks between them: 37,5 44,25 1,125.
bool HasDecimalCommas(std::string_view row);

// Throws IoError for degrees that cannot be right: latitudes beyond 90 degrees, and longitudes that
// lie at both ends of their range, so that points which are neighbours across the 180th (or 0th)
// meridian lie 360 degrees apart.
void RefuseWrongDegrees(const PointTable& table);

}  // namespace semblance::problems
