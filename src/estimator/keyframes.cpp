#include "keyframes.hpp"

#include <algorithm>

namespace bodyschema {

void Keyframes::keep(const Frame& frame, std::uint64_t block, const PostureMemory& memory, bool shown) {
  const auto kept = memory.blocks();
  std::erase_if(frames_,
                [&](const auto& item) { return std::find(kept.begin(), kept.end(), item.first) == kept.end(); });
  not_found_.clear();  // the estimate has learned something, and may be nearer
  auto& keyframe = frames_[block];
  keyframe.frame = frame;
  keyframe.frame.shown = shown;
  keyframe.pictures.resize(frame.seen.size());
  for (std::size_t c = 0; c < frame.seen.size(); ++c) {
    if (frame.seen[c] == nullptr) continue;
    auto& picture = keyframe.pictures[c];
    picture.mask = frame.seen[c]->mask;
    picture.valid = frame.seen[c]->valid;
    picture.coverage = frame.seen[c]->coverage;
    keyframe.frame.seen[c] = &picture;
  }
}

void Keyframes::look_again(PostureMemory& memory, OutlineFitter& fitter) {
  constexpr int kAtOnce = 2;
  for (int i = 0; i < kAtOnce; ++i) {
    const auto stale = memory.most_stale(not_found_);
    if (!stale) return;
    const auto keyframe = frames_.find(stale->block);
    const auto first =
        keyframe != frames_.end() ? fitter.about(keyframe->second.frame, stale->x) : std::optional<Quadratic>();
    if (first) {
      memory.relinearise(stale->block, *first, stale->x);
    } else {
      not_found_.push_back(stale->block);
    }
  }
}

void Keyframes::forget() {
  frames_.clear();
  not_found_.clear();
}

}  // namespace bodyschema
