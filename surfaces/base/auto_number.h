// SPDX-License-Identifier: GPL-3.0-or-later
// A number that may be left to the program.
#pragma once

namespace semblance {

// In a config a number, or the word `auto`; then `value` says nothing but where a search starts.
// Reads as its value.
struct AutoNumber {
  double value = 0;
  bool automatic = false;

  constexpr AutoNumber(double number = 0) : value(number) {}  // NOLINT: stands for a number
  static constexpr AutoNumber Auto(double start = 1) {
    AutoNumber number(start);
    number.automatic = true;
    return number;
  }
  constexpr operator double() const { return value; }  // NOLINT
};

}  // namespace semblance
