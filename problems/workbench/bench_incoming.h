// SPDX-License-Identifier: GPL-3.0-or-later
// What the browser has sent: files in FOLDER/incoming, a folder for each batch, until they are
// opened.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace semblance {

// Keeps a file of a batch, and returns its path. name: as the browser tells it, with folders where
// a whole folder was dropped ("slices/1.dcm"). Throws InputError for a batch or a name that could
// lead elsewhere or be no name everywhere: each part has 1 to 200 bytes of UTF-8, no control
// characters, no backslash and no dot in front; IoError as WriteFileAtomically.
std::filesystem::path SaveIncoming(const std::filesystem::path& root, const std::string& batch,
                                   const std::string& name, std::string_view bytes);

// Where the files of a batch lie. Throws InputError as above.
std::filesystem::path IncomingBatch(const std::filesystem::path& root, const std::string& batch);

// The batch's folder that holds `path`; empty for a path of elsewhere.
std::filesystem::path BatchOf(const std::filesystem::path& root, const std::filesystem::path& path);

// Forgets a batch, or all; what was opened of it lies elsewhere by then.
void DropIncoming(const std::filesystem::path& root, const std::string& batch);
void DropAllIncoming(const std::filesystem::path& root);

}  // namespace semblance
