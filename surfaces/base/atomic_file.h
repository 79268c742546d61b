// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files: read at once; written so that they are either the old one or the new one, never half
// of one.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace semblance {

// What a written file survives. kUnsynced: the end of the process, however it ends, but after a
// power failure the file may be empty. That spares two waits for the disk, and is for files that
// are checked when read and can be made again.
enum class Durability { kSynced, kUnsynced };

// Writes a temporary file beside `path`, syncs it, and renames it to `path`, which then holds
// exactly `bytes`. On failure throws IoError with the path and the system's reason; `path` is then
// as it was, and no temporary file is left.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes,
                         Durability durability = Durability::kSynced);

// The whole file. Throws IoError with the path and the reason: no such file, a folder, or what the
// system says.
std::string ReadFileBytes(const std::filesystem::path& path);

}  // namespace semblance
