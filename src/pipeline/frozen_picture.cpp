#include "bodyschema/pipeline/frozen_picture.hpp"

#include <algorithm>
#include <cstring>

namespace bodyschema {
namespace {

/// FNV-1a over words.
std::uint64_t digest_of(const Image& image) {
  std::uint64_t state = 0xcbf29ce484222325ull;
  std::size_t i = 0;
  for (; i + sizeof(std::uint64_t) <= image.data.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, image.data.data() + i, sizeof word);
    state = (state ^ word) * 0x100000001b3ull;
  }
  for (; i < image.data.size(); ++i) state = (state ^ image.data[i]) * 0x100000001b3ull;
  return state;
}

}  // namespace

PictureChange FrozenPicture::look(const Image& image, const Eigen::VectorXd& q) {
  const std::uint64_t digest = digest_of(image);
  change_.repeated = !first_ && digest == digest_ && q.size() == q_.size();
  if (change_.repeated) {
    change_.moved_rad = std::max(change_.moved_rad, (q - q_).cwiseAbs().maxCoeff());
    return change_;
  }
  first_ = false;
  digest_ = digest;
  q_ = q;
  change_.moved_rad = 0.0;
  return change_;
}

}  // namespace bodyschema
