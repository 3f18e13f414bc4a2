"""Records a log of all four message types, has `bodyschema log to-mcap` rewrite it, and reads the
result with the official reader; exit 77 means skipped.

usage: mcap_reads_back.py BODYSCHEMA TYPES_DIR VENV_DIR SCRATCH_DIR
"""
import base64
import json
import math
import pathlib
import struct
import subprocess
import sys

from python_packages import SKIPPED, python_with

BEGIN_US = 1_700_000_000_000_000
FRAMES = 40


def write_log(path):
    """An LCM log of 40 frames, encoded by lcm-gen's Python types: none of our C++ is involved."""
    # pylint: disable=import-outside-toplevel
    from bodyschema import joint_offsets_t, offsets_status_t, pose_t
    from bot_core import image_t, images_t, joint_state_t
    with open(path, "wb") as log:
        number = 0

        def event(channel, utime, message):
            nonlocal number
            data = message.encode() if hasattr(message, "encode") else message
            log.write(struct.pack(">IqqII", 0xEDA1DA01, number, utime, len(channel), len(data)))
            log.write(channel.encode() + data)
            number += 1

        for i in range(FRAMES):
            utime = BEGIN_US + i * 100_000
            joints = joint_state_t()
            joints.utime, joints.num_joints = utime, 2
            joints.joint_name = ["r_elbow", "r_wrist_yaw"]
            joints.joint_position = [math.radians(10.0 + i), math.radians(-5.0)]
            joints.joint_velocity, joints.joint_effort = [0.5, 0.0], [0.0, 0.0]
            event("ICUB_JOINT_STATE", utime + 500, joints)
            pictures = images_t()
            pictures.utime, pictures.n_images, pictures.image_types = utime, 2, [0, 1]
            for width, height, pixelformat, channels in ((64, 48, image_t.PIXEL_FORMAT_RGB, 3),
                                                         (320, 240, image_t.PIXEL_FORMAT_GRAY, 1)):
                picture = image_t()
                picture.utime, picture.width, picture.height = utime, width, height
                picture.row_stride, picture.pixelformat = width * channels, pixelformat
                picture.data = bytes(i for _ in range(width * height * channels))
                picture.size = len(picture.data)
                pictures.images.append(picture)
            event("ICUB_CAMERAS", utime + 6000, pictures)
            offsets = joint_offsets_t()
            offsets.utime, offsets.sequence, offsets.state = utime, i, "converged"
            offsets.num_joints, offsets.joint_name = 1, ["r_elbow"]
            offsets.mean_rad, offsets.covariance_rad2 = [math.radians(3.0)], [[math.radians(0.5) ** 2]]
            offsets.told = [1]
            pose = pose_t()
            pose.position_m, pose.quaternion_wxyz = [0.1, 0.2, 0.3], [1.0, 0.0, 0.0, 0.0]
            offsets.num_cameras, offsets.camera_name, offsets.hand_pose_in_camera = 1, ["left"], [pose]
            event("ICUB_JOINT_OFFSETS", utime + 30_000, offsets)
        status = offsets_status_t()
        status.utime, status.level, status.sentence = BEGIN_US, 1, "hand not in view"
        status.image_age_ms = math.inf
        event("ICUB_OFFSETS_STATUS", BEGIN_US + 4_000_000, status)
        event("SOMEBODY_ELSE", BEGIN_US + 4_100_000, b"anything")


def jpeg_size(data):
    """Width and height as a JPEG file itself says."""
    at = 2
    while data[at + 1] not in (0xC0, 0xC1, 0xC2):
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    return struct.unpack(">HH", data[at + 5:at + 9])[::-1]


def check_mcap(path):
    from mcap.reader import make_reader  # pylint: disable=import-error,import-outside-toplevel
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        topics = {c.topic: summary.statistics.channel_message_counts[i] for i, c in summary.channels.items()}
        assert topics == {"/ICUB_JOINT_STATE": FRAMES, "/ICUB_CAMERAS/left": FRAMES,
                          "/ICUB_CAMERAS/right": FRAMES, "/ICUB_JOINT_OFFSETS": FRAMES,
                          "/ICUB_OFFSETS_STATUS": 1}, topics
        assert summary.chunk_indexes, "no index: viewers could not seek"
        schemas = {s.name for s in summary.schemas.values()}
        assert {"foxglove.CompressedImage", "bodyschema.JointState", "bodyschema.JointOffsets",
                "bodyschema.OffsetsStatus"} <= schemas, schemas
        for schema in summary.schemas.values():
            assert schema.encoding == "jsonschema"
            described = json.loads(schema.data)
            assert described["type"] == "object" and "timestamp" in described["properties"]

        seen, last = 0, 0
        for schema, channel, message in reader.iter_messages():
            content = json.loads(message.data)
            assert set(content) == set(json.loads(schema.data)["properties"]), schema.name
            assert message.log_time >= last, "not in order of time"
            last, seen = message.log_time, seen + 1
            stamp_us = content["timestamp"]["sec"] * 1_000_000 + content["timestamp"]["nsec"] // 1000
            assert message.publish_time == stamp_us * 1000
            i = (stamp_us - BEGIN_US) // 100_000
            if channel.topic == "/ICUB_JOINT_STATE":
                assert message.log_time == (stamp_us + 500) * 1000
                assert abs(content["position_deg"]["r_elbow"] - (10.0 + i)) < 1e-4
                assert abs(content["velocity_deg_s"]["r_elbow"] - math.degrees(0.5)) < 1e-4
            elif channel.topic.startswith("/ICUB_CAMERAS"):
                picture = base64.b64decode(content["data"], validate=True)
                left = channel.topic.endswith("/left")
                assert content["format"] == "jpeg" and content["frame_id"] == ("left" if left else "right")
                assert jpeg_size(picture) == ((64, 48) if left else (320, 240))
            elif channel.topic == "/ICUB_JOINT_OFFSETS":
                assert abs(content["offset_deg"]["r_elbow"] - 3.0) < 1e-9
                assert abs(content["stddev_deg"]["r_elbow"] - 0.5) < 1e-9
                assert content["hand_in_camera"]["left"]["position_m"] == {"x": 0.1, "y": 0.2, "z": 0.3}
            else:
                assert content["level_name"] == "WARN" and content["sentence"] == "hand not in view"
                assert content["image_age_ms"] is None
        assert seen == 4 * FRAMES + 1, seen
        # A viewer that jumps to the last second of one topic.
        late = list(reader.iter_messages(topics=["/ICUB_CAMERAS/right"],
                                         start_time=(BEGIN_US + 3_000_000) * 1000))
        assert len(late) == 10, len(late)


def main():
    program, types, directory, scratch = (pathlib.Path(a) for a in sys.argv[1:5])
    if len(sys.argv) > 5:  # the part that needs the official package, in its interpreter
        check_mcap(scratch)
        return 0
    python = python_with(directory, "mcap")
    if python is None:
        return SKIPPED
    sys.path.insert(0, str(types))
    scratch.mkdir(parents=True, exist_ok=True)
    log, mcap = scratch / "all_types.lcmlog", scratch / "all_types.mcap"
    write_log(log)
    told = subprocess.run([program, "log", "to-mcap", log, "--out", mcap], check=True, text=True,
                          stdout=subprocess.PIPE, timeout=120).stdout
    print(told)
    assert "type is not known here: 1" in told
    subprocess.run([python, __file__, program, types, directory, mcap, "check"], check=True, timeout=120)

    # Wrong input: one line, status 2, nothing left behind.
    for arguments in ([scratch / "missing.lcmlog", "--out", scratch / "no.mcap"],
                      [pathlib.Path(__file__), "--out", scratch / "no.mcap"],
                      [log, "--out", "/nonexistent/no.mcap"]):
        wrong = subprocess.run([program, "log", "to-mcap", *arguments], text=True, check=False,
                               capture_output=True, timeout=60)
        assert wrong.returncode == 2 and wrong.stderr.count("\n") == 1, wrong
        assert not list(scratch.glob("no.mcap*"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
