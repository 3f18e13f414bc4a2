#include "bodyschema/pipeline/frozen_picture.hpp"

#include <algorithm>
#include <cstring>

#include "bodyschema/core/digest.hpp"

namespace bodyschema {
namespace {

std::uint64_t digest_of(const Image& image) {
  Digest digest;  // over words, as it is of every picture
  std::size_t i = 0;
  for (; i + sizeof(std::uint64_t) <= image.data.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, image.data.data() + i, sizeof word);
    digest.add_word(word);
  }
  digest.add(image.data.data() + i, image.data.size() - i);
  return digest.value();
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
