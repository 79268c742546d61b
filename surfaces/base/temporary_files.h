// SPDX-License-Identifier: GPL-3.0-or-later
// What WriteFileAtomically (atomic_file.h) writes before it renames, and what of it a kill leaves.
#pragma once

#include <filesystem>

namespace semblance {

// "dir/.face.ply.123-4.tmp" for "dir/face.ply": the process, and a count of its own.
std::filesystem::path TemporaryBeside(const std::filesystem::path& path);

// Removes such files in `folder` (not below it) whose process was killed. One that a living process
// still writes is locked (flock), and stays, as all other files do.
void SweepTemporaryFiles(const std::filesystem::path& folder);

// Makes renames in `folder` last over a power failure, where the file system can.
void SyncFolder(const std::filesystem::path& folder);

}  // namespace semblance
