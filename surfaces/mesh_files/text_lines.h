// SPDX-License-Identifier: GPL-3.0-or-later
// The lines of a mesh file that is text, and the words and numbers of each line. Whatever is wrong
// is an InputError that names the file and the line.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "surfaces/base/geometry.h"

namespace semblance {

class TextLines {
 public:
  struct Options {
    char comment = '\0';          // begins a comment, which ends with the line; 0: there are none
    std::int64_t first_line = 1;  // number of the text's first line in its file
  };
  // Keeps a view of `text`. name: the file, for messages.
  TextLines(std::string_view text, std::string name, const Options& options);

  // Goes to the next line that has a word; false if there is none.
  bool NextLine();
  std::int64_t LineNumber() const { return number_; }

  // Of the current line:
  bool AtLineEnd();
  std::string_view NextWord();  // empty at the line's end
  float NextFloat();            // may be NaN or infinite
  double NextDouble();          // may be NaN or infinite
  // Three finite numbers, mm: of single precision, with all their digits where its steps are more
  // than 1e-4 mm, which is from 1024 mm on.
  Vec3 NextPoint();
  // what: for the message, e.g. "number of vertices".
  std::int64_t NextInteger(const char* what, std::int64_t lowest, std::int64_t highest);
  void ExpectLineEnd();
  std::string_view RestOfLine();
  void StepBack(std::size_t bytes) { at_ -= bytes; }  // into the word just read

  // Of the text:
  std::size_t Position() const { return next_; }  // where the next line begins
  std::size_t BytesLeft() const { return text_.size() - next_; }

  // what: what is wrong; what is allowed or what to do.
  [[noreturn]] void Fail(const std::string& what) const { FailAt(number_, what); }
  [[noreturn]] void FailAt(std::int64_t line, const std::string& what) const;

 private:
  template <class T>
  T NextNumber();
  template <class T>
  T OutOfRange(std::string_view word) const;

  std::string_view text_, line_;
  std::string name_;
  char comment_;
  std::size_t next_ = 0, at_ = 0;
  std::int64_t number_;
};

}  // namespace semblance
