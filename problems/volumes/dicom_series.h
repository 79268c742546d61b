// SPDX-License-Identifier: GPL-3.0-or-later
// Which of the files of a folder make a volume.
#pragma once

#include <string>
#include <vector>

#include "problems/volumes/itk_files.h"

namespace semblance {

// Slices of one series, one size and one direction: a scout within a series is a part of its own.
struct DicomSeries {
  std::string name;  // what chooses it: the series' number; where several share it, with ":1" etc.
  std::vector<DicomHeader> slices;  // as they were listed

  const DicomHeader& First() const { return slices.front(); }
};

// The parts of all series that have an image with a place in space, in the order of their first
// file. Images without a place, and files with several images, are told in `notes`.
std::vector<DicomSeries> GroupSeries(const std::vector<DicomHeader>& headers,
                                     std::vector<std::string>& notes);

// E.g. "3: CT, 120 slices of 512 x 512, 'Head 1.0 H60', UID 1.2.3".
std::string InWords(const DicomSeries& series);

// The one that `wanted` (name, number or UID; if empty, any) means. Of several the only one that
// can be a head, CT or MR with 8 slices and more, and if `wanted` is empty no other. What is left
// out is told in `notes`. Throws InputError, naming `where`, with the list if none or several fit.
const DicomSeries& ChooseSeries(const std::vector<DicomSeries>& all, const std::string& wanted,
                                const std::string& where, std::vector<std::string>& notes);

}  // namespace semblance
