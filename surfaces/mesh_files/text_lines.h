// SPDX-License-Identifier: GPL-3.0-or-later
// Shared by the readers of mesh files: the lines, words and numbers of a text, limits, and the
// precision of coordinates.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// The largest number of vertices, faces or other elements in a file: an index of a triangle can
// name no more.
inline constexpr std::int64_t kMaxElements = 2147483647;

// The largest step between coordinates that loses nothing of a mesh. Single precision has smaller
// steps below 1024 mm.
inline constexpr double kCoordinateStep_mm = 1e-4;

// The step from a coordinate to the next in single precision: 3e-5 at 300, 0.5 at five million,
// infinity beyond the range.
double SingleStep(double coordinate);

// Appends a polygon as triangles that share its first corner; none if it has fewer than 3 corners.
void AppendFan(std::span<const std::int32_t> corners, std::vector<Triangle>& triangles);

// Makes triangles of the polygons of a file. A fan is right for a convex polygon only, and a file
// may name vertices before it lists them, so concave polygons get other triangles at the end.
class PolygonFans {
 public:
  // Appends a polygon as AppendFan does.
  void Append(std::span<const std::int32_t> corners, std::vector<Triangle>& triangles);
  // Replaces the fan of each concave polygon by as many triangles that lie inside it. The polygon
  // is seen along its mean normal; its ears are cut off one by one. A polygon that crosses itself
  // keeps a fan of what is left. Throws InputError, beginning with `name`, for a concave polygon of
  // more than 1,000 corners, which would take too long.
  void Finish(TriMesh& mesh, const std::string& name) const;

 private:
  struct Fan {
    std::size_t first = 0, corners = 0;  // first triangle; at least 4 corners
  };
  std::vector<Fan> fans_;
};

// A piece of a file for a message: at most 40 characters, with '?' for those that cannot be
// printed.
std::string Shown(std::string_view piece);

// True if the bytes are white space and zeros only, with which some programs pad a file.
bool IsPadding(std::string_view bytes);

// Reads a text line by line. Lines end with a line feed, or all of them with a carriage return, as
// on old Macs. A byte order mark at the beginning is skipped. Every fault is an InputError that
// names the file and the line.
class TextLines {
 public:
  struct Options {
    char comment = '\0';          // begins a comment, which ends with the line; 0: there are none
    std::int64_t first_line = 1;  // number of the text's first line in its file
    // A line without a comment goes on in the next one if it ends with a backslash, as in an OBJ.
    bool goes_on_after_backslash = false;
  };
  // Keeps a view of `text`. name: the file, for messages.
  TextLines(std::string_view text, std::string name, const Options& options);

  // Goes to the next line that has a word; false if there is none.
  bool NextLine();
  std::int64_t LineNumber() const;  // in the file; of the place that was read last

  // These read the current line.
  bool AtLineEnd();
  std::string_view NextWord();  // empty at the line's end
  float NextFloat();            // may be NaN or infinite
  double NextDouble();          // may be NaN or infinite
  // Three finite numbers, mm. They have single precision, or all their digits if the steps of
  // single precision exceed kCoordinateStep_mm there, which is so from 1024 mm on.
  Vec3 NextPoint();
  // what: for the message, e.g. "number of vertices".
  std::int64_t NextInteger(const char* what, std::int64_t lowest, std::int64_t highest);
  void ExpectLineEnd();
  std::string_view RestOfLine();
  // The rest of the line with spaces and '#', which names in an OBJ may contain; without white
  // space at its ends.
  std::string_view RestAsName();
  void StepBack(std::size_t bytes) { at_ -= bytes; }  // into the word just read

  std::size_t NextLineStart() const { return next_; }  // in bytes of the text
  std::size_t BytesLeft() const { return text_.size() - next_; }

  // what: what is wrong; what is allowed or what to do.
  [[noreturn]] void Fail(const std::string& what) const { FailAt(LineNumber(), what); }
  [[noreturn]] void FailAt(std::int64_t line, const std::string& what) const;

 private:
  std::string_view TakeLine();
  bool GoesOn() const;
  void JoinNextLines();
  template <class T>
  T NextNumber();
  template <class T>
  T OutOfRange(std::string_view word) const;

  std::string_view text_, whole_line_, line_;  // line_ is whole_line_ without the comment
  std::string name_;
  char comment_, line_end_ = '\n';
  bool goes_on_;
  std::size_t next_ = 0, at_ = 0;
  std::int64_t number_;              // of the last line taken from the text
  std::string joined_;               // a line that goes on, with the lines after it
  std::vector<std::size_t> joints_;  // beginnings of these lines in it
};

}  // namespace semblance::surfaces
