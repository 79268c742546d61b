// SPDX-License-Identifier: GPL-3.0-or-later
// Read before all else where volume_fuzz is compiled: Debian's header of ITK that says what a
// compiler can do knows g++ alone. Clang can do all that ITK asks about.
#pragma once

#define ITK_COMPILER_DETECTION_H
#define ITK_COMPILER_CXX_STATIC_ASSERT 1
#define ITK_CONSTEXPR constexpr
#define ITK_DEPRECATED_MSG(words) [[deprecated(words)]]
#define ITK_NOEXCEPT noexcept
