// SPDX-License-Identifier: GPL-3.0-or-later
// UTF-8: checks the bytes of a configuration, or of another text, before it is parsed; takes texts
// apart into characters; and writes equal texts with equal bytes.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/config/config_tree.h"

namespace semblance::problems {

// Adds an error for each line that has a tab outside a comment (it looks like spaces), another
// control character, or a byte that is not UTF-8. Returns true if there is none.
bool RequireReadableBytes(std::string_view text, const std::shared_ptr<const ConfigSource>& source,
                          ConfigErrors& errors);

// Returns the line, from 1, of the first byte that is not UTF-8, or nothing.
std::optional<int> LineThatIsNotUtf8(std::string_view text);

// The number of a character in Unicode, and its bytes in the text.
struct Character {
  char32_t code = kNotUtf8;
  std::string_view bytes;
  static constexpr char32_t kNotUtf8 = 0xFFFFFFFF;  // one byte that is not UTF-8
};
std::vector<Character> SplitCharacters(std::string_view text);

// True for a character that controls a terminal or the order of letters: control characters, line
// and paragraph separators, and marks that turn the direction of writing (U+061C, U+200E, U+200F,
// U+202A to U+202E, U+2066 to U+2069). True for a byte that is not UTF-8.
bool ControlsText(char32_t code);

// The two normal forms of Unicode. A letter with an accent is one character in NFC, which most
// keyboards write, and two in NFD, which names of files from a Mac often are.
enum class NormalForm { kComposed, kDecomposed };

// Writes a text in a normal form, so that names are equal if they look alike. A text that is not
// UTF-8 stays as it is.
std::string Normalized(std::string_view text, NormalForm form = NormalForm::kComposed);

}  // namespace semblance::problems
