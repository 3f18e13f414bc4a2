#pragma once

#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis/measurement.hpp"

namespace bodyschema::test {

/// A log of which some pictures are left out or repeated, or whose encoder log is another one.
class EditedLog final : public MeasurementSource {
 public:
  EditedLog(MeasurementSource& log, std::vector<std::size_t> which) : log_(log), which_(std::move(which)) {
    for (const auto v : which_) views_.push_back(log.views()[v]);
    stream_.assign(log.stream().begin(), log.stream().end());
  }
  static EditedLog whole(MeasurementSource& log) {
    std::vector<std::size_t> all(log.views().size());
    for (std::size_t v = 0; v < all.size(); ++v) all[v] = v;
    return {log, std::move(all)};
  }
  std::vector<JointSample>& stream_for_editing() { return stream_; }
  std::vector<ViewInput>& views_for_editing() { return views_; }
  /// The robot is not seen in this picture.
  void hide(std::size_t view) { hidden_.insert(view); }

  const JointRoles& roles() const override { return log_.roles(); }
  std::span<const ViewInput> views() const override { return views_; }
  std::span<const JointSample> stream() const override { return stream_; }
  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override {
    log_.instant(which_[view], offsets, out);
  }
  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override {
    std::vector<Corrections> all(log_.views().size(), Corrections(corrections.front().dq.size()));
    for (std::size_t v = 0; v < which_.size(); ++v) all[which_[v]] = corrections[v];
    std::vector<CompressedView> whole;
    log_.compress(all, whole);
    out.clear();
    for (const auto v : which_) out.push_back(whole[v]);
    for (const auto v : hidden_) {
      out[v].information.setZero();
      out[v].vector.setZero();
      out[v].square = out[v].weight = 0.0;
    }
  }
  Eigen::MatrixXd hand_jacobian(std::size_t view, const Corrections& c) override {
    return log_.hand_jacobian(which_[view], c);
  }

 private:
  MeasurementSource& log_;
  std::vector<std::size_t> which_;
  std::set<std::size_t> hidden_;
  std::vector<ViewInput> views_;
  std::vector<JointSample> stream_;
};

}  // namespace bodyschema::test
