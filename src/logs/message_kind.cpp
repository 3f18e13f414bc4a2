#include "message_kind.hpp"

#include <string>

#include "bodyschema/findings_t.hpp"
#include "bodyschema/joint_offsets_t.hpp"
#include "bodyschema/offsets_status_t.hpp"

namespace bodyschema {

MessageKind kind_of(Bytes message) {
  if (message.size() < 8) return MessageKind::kUnknown;
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < 8; ++i) word = (word << 8) | message[i];
  const auto fingerprint = static_cast<std::int64_t>(word);
  if (fingerprint == bot_core::joint_state_t::getHash()) return MessageKind::kJointState;
  if (fingerprint == bot_core::images_t::getHash()) return MessageKind::kImages;
  if (fingerprint == joint_offsets_t::getHash()) return MessageKind::kJointOffsets;
  if (fingerprint == offsets_status_t::getHash()) return MessageKind::kOffsetsStatus;
  if (fingerprint == findings_t::getHash()) return MessageKind::kFindings;
  return MessageKind::kUnknown;
}

const char* name_of(MessageKind kind) {
  switch (kind) {
    case MessageKind::kJointState: return "bot_core.joint_state_t";
    case MessageKind::kImages: return "bot_core.images_t";
    case MessageKind::kJointOffsets: return "bodyschema.joint_offsets_t";
    case MessageKind::kOffsetsStatus: return "bodyschema.offsets_status_t";
    case MessageKind::kFindings: return "bodyschema.findings_t";
    case MessageKind::kUnknown: return "?";
  }
  return "?";
}

std::string camera_name(int image_type) {
  if (image_type == bot_core::images_t::LEFT) return "left";
  if (image_type == bot_core::images_t::RIGHT) return "right";
  return "camera " + std::to_string(image_type);
}

}  // namespace bodyschema
