#pragma once

#include <filesystem>
#include <vector>

#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema::simulator {

/// Pictures of one run side by side, evenly spread over its motion, for people to look at. One thread.
class ContactSheet {
 public:
  /// @param first, count  frames to choose from; @param columns, rows  of pictures
  ContactSheet(int first, int count, int columns = 4, int rows = 4);
  /// Keeps the frame's picture (or mask) if it is one of those. Even places show the first camera, odd ones the
  /// second, if there is one.
  void add(const SimulatedFrame& frame);
  [[nodiscard]] Image image() const;
  /// A PNG. Throws as write_file (core/write_file.hpp), FileError for another ending.
  void write(const std::filesystem::path& file) const;

 private:
  int first_, count_, columns_, rows_;
  std::vector<Image> pictures_;
};

}  // namespace bodyschema::simulator
