// SPDX-License-Identifier: GPL-3.0-or-later
// The bytes within a gzip file.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace semblance {

// By the file's first two bytes.
bool IsGzip(const std::filesystem::path& file);

// Hands over the unpacked bytes, block after block, until `take` returns false; no more than a
// block is in memory. Members that follow each other are one stream, and what is behind the last is
// left, as gzip itself has it. Throws IoError, naming the file, where it ends within a member or is
// damaged: the checksum and the length of each member that is read to its end are looked at.
void Unpack(const std::filesystem::path& file,
            const std::function<bool(std::string_view block)>& take);

// The same of bytes that are in memory already. name: for messages.
std::string Unpacked(std::string_view bytes, const std::string& name);

}  // namespace semblance
