// SPDX-License-Identifier: GPL-3.0-or-later
// A value that may be left to the program.
#pragma once

namespace semblance {

// In a config a value, or the word `auto`; then `value` says nothing but where a search starts.
// Reads as its value.
template <class T>
struct AutoOr {
  T value = {};
  bool automatic = false;

  constexpr AutoOr(T given = {}) : value(given) {}  // NOLINT: stands for a value
  static constexpr AutoOr Auto(T start = 1) {
    AutoOr result(start);
    result.automatic = true;
    return result;
  }
  constexpr operator T() const { return value; }  // NOLINT
};

}  // namespace semblance
