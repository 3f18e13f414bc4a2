#include "swapped_eyes.hpp"

#include <array>

namespace bodyschema {
namespace {

/// A frame whose eyes each have what the other one saw of the robot; without the pictures.
class ExchangedFrame {
 public:
  explicit ExchangedFrame(const Frame& frame) : frame_(frame) {
    for (std::size_t c = 0; c < eyes_.size(); ++c) {
      const CameraObservation& other = *frame.seen[1 - c];
      eyes_[c].mask = other.mask;
      eyes_[c].valid = other.valid;
      eyes_[c].coverage = other.coverage;
      frame_.seen[c] = &eyes_[c];
    }
  }
  ExchangedFrame(const ExchangedFrame&) = delete;
  ExchangedFrame& operator=(const ExchangedFrame&) = delete;
  [[nodiscard]] const Frame& frame() const { return frame_; }

 private:
  std::array<CameraObservation, 2> eyes_;
  Frame frame_;
};

}  // namespace

bool SwappedEyes::turned(const Frame& frame, const Eigen::VectorXd& known) {
  if (!scorer_.can_be_exchanged()) return false;
  const ExchangedFrame exchanged(frame);
  scorer_.observe(exchanged.frame(), min_mask_share_);
  const double other_distance = scorer_.distance(known);
  scorer_.observe(frame, min_mask_share_);
  return EyeOrder::clearly_exchanged(scorer_.distance(known), other_distance);
}

std::optional<bool> SwappedEyes::from_the_start(const Frame& frame, const PostureMemory& memory) {
  if (order_.settled() || !scorer_.can_be_exchanged()) return false;
  const ExchangedFrame exchanged(frame);
  if (!search_) {
    const Eigen::VectorXd distances = particles_.score_first_guesses(frame);
    scorer_.observe(exchanged.frame(), min_mask_share_);
    const Eigen::VectorXd other_distances = scorer_.score(static_cast<std::size_t>(distances.size()));
    if (!EyeOrder::worth_searches(distances.minCoeff(), other_distances.minCoeff())) {
      scorer_.observe(frame, min_mask_share_);
      return found_ = order_.exchanged(distances.minCoeff(), other_distances.minCoeff());
    }
    constexpr std::size_t kStarts = 12;  // from three, one arm in 300 that began far off was not found
    search_.emplace();
    search_->as_they_are.starts = particles_.nearest_guesses(distances, kStarts);
    search_->exchanged.starts = particles_.nearest_guesses(other_distances, kStarts);
  }
  // In turn where a frame has not room for both, so that both are searched for in the same pictures, nearly.
  auto &as_they_are = search_->as_they_are, &other = search_->exchanged;
  const bool other_first = other.next <= as_they_are.next;
  bool through = other_first ? go_on(exchanged.frame(), memory, other) : go_on(frame, memory, as_they_are);
  through &= other_first ? go_on(frame, memory, as_they_are) : go_on(exchanged.frame(), memory, other);
  scorer_.observe(frame, min_mask_share_);
  if (!through) return found_;
  found_ = order_.exchanged(as_they_are.least, other.least);
  search_.reset();
  return found_;
}

/// Goes on with one of both searches, in the pictures as they are or exchanged.
bool SwappedEyes::go_on(const Frame& shown, const PostureMemory& memory, StartSearch& search) {
  scorer_.observe(shown, min_mask_share_);
  // What is known, however little, is looked after in every frame.
  const int room = memory.empty() ? 0 : 1;
  return fitter_.go_on(shown, memory.beliefs(), search, room);
}

}  // namespace bodyschema
