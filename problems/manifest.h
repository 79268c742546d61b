// SPDX-License-Identifier: GPL-3.0-or-later
// Which bytes went in and which came out.
#pragma once

#include <filesystem>
#include <string>

namespace semblance {

// Lower-case hexadecimal SHA-256 of a file's bytes. Throws IoError if it cannot be read.
std::string Sha256OfFile(const std::filesystem::path& path);

}  // namespace semblance
