// SPDX-License-Identifier: GPL-3.0-or-later
// The three ways in which a caller can be wrong, and a request to stop. Numerical outcomes are
// fields of results, not exceptions.
#pragma once

#include <stdexcept>
#include <string>

namespace semblance {

// Base of all errors that a user can correct. The message says where, what, what is allowed, and
// what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Data that cannot be used: a bad mesh, a NaN, a missing landmark.
class InputError : public Error {
 public:
  using Error::Error;
};

// A configuration that cannot be used; the message may hold several lines, one per error.
class ConfigError : public Error {
 public:
  using Error::Error;
};

// A file that cannot be read or written.
class IoError : public Error {
 public:
  using Error::Error;
};

// The caller asked to stop through RunContext::stop_token.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace semblance
