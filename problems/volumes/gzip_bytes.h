// SPDX-License-Identifier: GPL-3.0-or-later
// The bytes within a gzip file.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace semblance {

// By the file's first two bytes.
bool IsGzip(const std::filesystem::path& file);

// Hands over the unpacked bytes, block after block, until `take` returns false; no more than a
// block is in memory. Members that follow each other are one stream, and what is behind the last is
// left, as gzip itself has it. Throws IoError, naming the file, where it ends within a member or is
// damaged.
void Unpack(const std::filesystem::path& file,
            const std::function<bool(std::string_view block)>& take);

}  // namespace semblance
