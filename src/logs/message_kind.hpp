#pragma once

#include "bodyschema/bus/messages.hpp"

namespace bodyschema {

/// The types this project speaks, told by the fingerprint with which every LCM message begins.
enum class MessageKind { kJointState, kImages, kJointOffsets, kOffsetsStatus, kFindings, kUnknown };

MessageKind kind_of(Bytes message);
/// "bot_core.joint_state_t"; "?" for unknown ones.
const char* name_of(MessageKind kind);
/// "left", "right", "camera 7".
std::string camera_name(int image_type);

}  // namespace bodyschema
