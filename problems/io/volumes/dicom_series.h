// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the DICOM files of a folder that make a volume: groups slices into series, chooses one
// series, and orders its slices in space.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/io/volumes/itk_files.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// Names of tags for messages.
inline constexpr const char* kPositionTag = "Image Position (0020,0032)";
inline constexpr const char* kOrientationTag = "Image Orientation (0020,0037)";
inline constexpr const char* kSpacingTag = "Pixel Spacing (0028,0030)";
inline constexpr const char* kSlopeTag = "Rescale Slope (0028,1053)";
inline constexpr const char* kInterceptTag = "Rescale Intercept (0028,1052)";

// The numbers of a decimal string, which backslashes separate. Empty unless each is a number to its
// end. A comma in a number is a decimal comma, which programs write in locales that have it.
struct Decimals {
  std::vector<double> numbers;
  bool has_comma = false;
};
Decimals ParseDecimals(const std::string& text);

// Converts a text of a file to UTF-8. characters: the file's Specific Character Set (0008,0005).
// Bytes that this set lacks, and control characters, become '?'.
std::string DicomTextToUtf8(const std::string& text, const std::string& characters);

// A text in ASCII for a message: other bytes become '?', and a long text is cut.
std::string CleanDicomText(const std::string& text);

// Appends words to a list of words, separated by a comma.
void AddWords(const std::string& words, std::string& list);

// Normalises the directions. Sets the header's fault if they, or the spacing, are impossible.
void CheckSlicePlace(DicomHeader& header);

// Slices of one series, one size and one direction. A scout image within a series is a DicomSeries
// of its own.
struct DicomSeries {
  std::string name;  // the series' number; if several share the number, with ":1", ":2" ... added
  std::vector<DicomHeader> slices;  // in the order of the headers

  const DicomHeader& First() const { return slices.front(); }
};

// Groups all images that have a place in space, in the order of their first file. Slices that carry
// a series UID each, but agree in everything else, are one series. `notes` reports that, and images
// without a place, which are left out.
std::vector<DicomSeries> GroupSeries(const std::vector<DicomHeader>& headers,
                                     std::vector<std::string>& notes);

// E.g. "3: CT, 120 slices of 512 x 512, 'Head 1.0 H60', UID 1.2.3".
std::string DescribeSeries(const DicomSeries& series);

// Chooses the series whose name, number or UID is `wanted` (empty: any). A series can be a head if
// it is CT or MR with at least 8 slices, or if there is none of these, of a kind in which cone-beam
// scanners export volumes. If several series match, the only one that can be a head is chosen; if
// `wanted` is empty, the series must be able to be a head. `notes` reports the other series. Throws
// InputError, naming `where` and listing the series, if none or several remain.
const DicomSeries& ChooseSeries(const std::vector<DicomSeries>& all, const std::string& wanted,
                                const std::string& where, std::vector<std::string>& notes);

// headers: all that were read, because one with a fault may belong to the series though it has no
// place. Throws InputError, naming `where` and the files, for images with a fault, for slices of
// several patients or spaces, and if some slices lack a slope or intercept. Notes decimal commas
// and values without an intercept.
void CheckSeries(const DicomSeries& series, const std::vector<DicomHeader>& headers,
                 const std::string& where, std::vector<std::string>& notes);

struct StackOptions {
  // Interpolates missing slices, and uses the first of doubled slices. If false, both are errors.
  bool fill = false;
  double longest_fill_mm = 10;  // largest distance between slices to interpolate between
};

// Slices at equal distances along the normal, lowest first.
struct SliceStack {
  std::vector<int> scanned;    // indices of the slices in the input, lowest first
  std::vector<double> places;  // of the stack's slices in `scanned`; interpolated at fractions
  Vec3 origin = Vec3::Constant(kNaN);  // first voxel of the first slice, LPS, mm
  Vec3 step = Vec3::Constant(kNaN);    // from a slice to the next; oblique if the gantry was tilted
  std::vector<std::string> notes;
};

// positions: of the slices' first voxels, LPS, mm. normal: of all slices, unit. names: of the
// slices, for messages. Distances that are not multiples of one step make a stack that is
// interpolated at equal distances. Throws InputError, naming `where` and the positions along the
// normal, for fewer than 2 slices, doubled or missing slices (unless filled), distances above
// longest_fill_mm between unequal ones, and slices that are displaced sideways.
SliceStack StackSlices(std::span<const Vec3> positions, const Vec3& normal,
                       std::span<const std::string> names, const StackOptions& options,
                       const std::string& where);

// Notes that are no fault of the stack: slices that are much thinner than their distance, numbers
// of which every second is missing, and a tilt of the gantry that the positions do not show.
void NoteSliceTags(const DicomSeries& series, const SliceStack& stack, const Vec3& normal,
                   std::vector<std::string>& notes);

}  // namespace semblance::problems
