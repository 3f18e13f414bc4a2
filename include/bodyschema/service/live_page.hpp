#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// One camera as the page shows it: its picture and where the robot's outline is predicted.
struct CameraPicture {
  std::size_t camera = 0;  ///< position in the rig
  Image image;
  BinaryMask nominal;    ///< encoders as they are
  BinaryMask corrected;  ///< with the estimated offsets taken off
  bool frozen = false;   ///< the same picture again and again although the arm moves
};

/// A web page on this machine that shows what the service sees and thinks, for several viewers.
///
/// Answers GET on 127.0.0.1 only, for a handful of fixed paths; nothing is read from disk, nothing
/// can be changed, other hosts' pages cannot read it. The estimator hands over copies at a bounded
/// rate, and none at all while nobody watches; drawing and encoding happen in the page's thread, which
/// the scheduler serves after the estimator's. Any thread may call; the estimator's calls (add,
/// wants_pictures, set_pictures) wait for nobody, they rather leave something out.
class LivePage {
 public:
  /// Throws DeviceError when the port cannot be had or the page was not built in.
  /// @param port  0: any free one, see port()
  LivePage(int port, std::vector<std::string> camera_names);
  /// Within a second, whatever its clients do.
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  [[nodiscard]] int port() const;
  [[nodiscard]] std::string url() const;

  /// After a reload: forgets pictures and history.
  void start_anew(std::vector<std::string> camera_names);
  /// Every estimate may be given; those that come too soon after the last are not kept.
  void add(const Estimate& estimate);
  void set_status(const offsets_status_t& status);
  /// Whether somebody watches and new pictures are due. `idle`: the estimator has nothing to do.
  [[nodiscard]] bool wants_pictures(bool idle) const;
  void set_pictures(std::vector<CameraPicture> pictures);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
