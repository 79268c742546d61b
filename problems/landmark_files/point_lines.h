// SPDX-License-Identifier: GPL-3.0-or-later
// The lines of a file of points that is text, and the cells of a line.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace semblance {

std::string_view TrimBlanks(std::string_view text);

// The cells of one line, trimmed. A cell may be quoted, with "" for a quote inside.
std::vector<std::string> SplitCells(std::string_view line, char separator);

// Goes through the lines of a text that are not empty. Whatever is wrong is an IoError that names
// file and, after the first Next, line. The text must outlive it.
class PointLines {
 public:
  PointLines(std::string_view text, std::string_view file);

  // The next line that is not empty; false at the end.
  bool Next();
  std::string_view line() const { return line_; }

  // A finite decimal number.
  double Number(std::string_view cell) const;
  // what: what is wrong; what is allowed or what to do.
  [[noreturn]] void Fail(std::string_view what) const;

 private:
  std::string_view rest_;
  std::string file_;
  std::string_view line_;
  int number_ = 0;
};

}  // namespace semblance
