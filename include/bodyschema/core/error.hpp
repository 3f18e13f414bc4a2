#pragma once

#include <stdexcept>
#include <string>

namespace bodyschema {

/// Root of everything this library throws on bad input. `what()` is one line a user can act on:
/// it names the file, the key or item, the value found and what was expected.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A configuration file or value that cannot be used.
class ConfigurationError : public Error {
 public:
  using Error::Error;
};

/// A file (URDF, mesh, log, picture, recording) that is missing, broken or not what was expected.
class FileError : public Error {
 public:
  using Error::Error;
};

/// Measured data that cannot be used (log too short, channel missing, image size unexpected).
class DataError : public Error {
 public:
  using Error::Error;
};

/// Something the machine lacks (no GL context, no network route, disk full).
class DeviceError : public Error {
 public:
  using Error::Error;
};

}  // namespace bodyschema
