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

// Slices of one series, one size and one direction. A scout image within a series is a DicomSeries
// of its own.
struct DicomSeries {
  std::string name;  // the series' number; if several share the number, with ":1", ":2" ... added
  std::vector<DicomHeader> slices;  // in the order of the headers

  const DicomHeader& First() const { return slices.front(); }
};

// Groups all images that have a place in space, in the order of their first file. `notes` reports
// images without a place and files with several images; both are left out.
std::vector<DicomSeries> GroupSeries(const std::vector<DicomHeader>& headers,
                                     std::vector<std::string>& notes);

// E.g. "3: CT, 120 slices of 512 x 512, 'Head 1.0 H60', UID 1.2.3".
std::string DescribeSeries(const DicomSeries& series);

// Chooses the series whose name, number or UID is `wanted` (empty: any). A series can be a head if
// it is CT or MR with at least 8 slices. If several series match, the only one that can be a head
// is chosen; if `wanted` is empty, the series must be able to be a head. `notes` reports the other
// series. Throws InputError, naming `where` and listing the series, if none or several remain.
const DicomSeries& ChooseSeries(const std::vector<DicomSeries>& all, const std::string& wanted,
                                const std::string& where, std::vector<std::string>& notes);

struct StackOptions {
  // Interpolates missing slices, and uses the first of doubled slices. If false, both are errors.
  bool fill = false;
  double longest_fill_mm = 10;  // largest distance between the slices on both sides of a gap
};

// Slices at equal distances along the normal, lowest first.
struct SliceStack {
  std::vector<int> slices;             // index of the slice in the input; -1: missing
  Vec3 origin = Vec3::Constant(kNaN);  // first voxel of the first slice, LPS, mm
  Vec3 step = Vec3::Constant(kNaN);    // from a slice to the next; oblique if the gantry was tilted
  std::vector<std::string> notes;
};

// positions: of the slices' first voxels, LPS, mm. normal: of all slices, unit. names: of the
// slices, for messages. Throws InputError, naming `where` and the positions along the normal, for
// fewer than 2 slices, doubled or missing slices (unless filled), distances that are not multiples
// of one step, and slices that are displaced sideways.
SliceStack StackSlices(std::span<const Vec3> positions, const Vec3& normal,
                       std::span<const std::string> names, const StackOptions& options,
                       const std::string& where);

// The angle between the stack's step and the slices' normal, deg; 0 without gantry tilt.
double TiltDeg(const SliceStack& stack, const Vec3& normal);

}  // namespace semblance::problems
