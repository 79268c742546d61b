// SPDX-License-Identifier: GPL-3.0-or-later
// The exceptions: three kinds of wrong input, lack of memory, and a request to stop. A numerical
// outcome is a field of a result, not an exception.
#pragma once

#include <stdexcept>
#include <string>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// Base of all errors that a user can correct. The message states the place, the fault, what is
// allowed, and the remedy.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Unusable data: a bad mesh, a NaN, a missing landmark.
class InputError : public Error {
 public:
  using Error::Error;
};

// An unusable configuration. The message may hold several lines, one per error.
class ConfigError : public Error {
 public:
  using Error::Error;
};

// A file that cannot be read or written.
class IoError : public Error {
 public:
  using Error::Error;
};

// Too little memory for the work. The message suggests a smaller request.
class OutOfMemory : public Error {
 public:
  using Error::Error;
};

// The caller asked to stop through RunContext::stop_token.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace semblance::surfaces
