// SPDX-License-Identifier: GPL-3.0-or-later
// Work for which the memory did not suffice, and what to ask for instead.
#pragma once

#include "surfaces/base/error.h"

namespace semblance {

class OutOfMemory : public Error {
 public:
  using Error::Error;
};

}  // namespace semblance
