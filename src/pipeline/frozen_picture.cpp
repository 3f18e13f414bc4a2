#include "bodyschema/pipeline/frozen_picture.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "bodyschema/core/digest.hpp"

namespace bodyschema {
namespace {

std::uint64_t digest_of(const Image& image) {
  // Over words, in four strands that the processor works on at once, as it is of every picture.
  constexpr std::size_t kStrands = 4;
  std::array<Digest, kStrands> strands;
  std::array<std::uint64_t, kStrands> words{};
  std::size_t i = 0;
  for (; i + sizeof words <= image.data.size(); i += sizeof words) {
    std::memcpy(words.data(), image.data.data() + i, sizeof words);
    for (std::size_t s = 0; s < kStrands; ++s) strands[s].add_word(words[s]);
  }
  Digest digest;
  for (const Digest& strand : strands) digest.add_word(strand.value());
  digest.add(image.data.data() + i, image.data.size() - i);
  return digest.value();
}

}  // namespace

PictureChange FrozenPicture::look(const Image& image, const Eigen::VectorXd& q) {
  const std::uint64_t digest = digest_of(image);
  change_.repeated = digest == digest_ && q.size() == q_.size();
  if (change_.repeated) {
    change_.moved_rad = std::max(change_.moved_rad, (q - q_).cwiseAbs().maxCoeff());
    return change_;
  }
  digest_ = digest;
  q_ = q;
  change_.moved_rad = 0.0;
  return change_;
}

}  // namespace bodyschema
