"""Reads a ROS bag (ROS 2 MCAP or SQLite, ROS 1) and writes records (framing.py).

usage: read_ros_bag.py BAG list
       read_ros_bag.py BAG read JSON

`list` writes a record "topic" for each topic: topic, type, count, and what its first message shows ("names" of
joints, "encoding", "format", "frame"). `read` writes the messages of the topics that JSON names, in the order of
their record stamps: {"joints": [TOPIC...], "pictures": [TOPIC...], "infos": [TOPIC...]}; and of all transforms
between frames, once at the end.
"""
import json
import math
import pathlib
import sys

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import framing

MOST_NAMES = 4096
MOST_TRANSFORMS = 10000
TRANSFORMS = "tf2_msgs/msg/TFMessage"
ROS1_TRANSFORMS = "tf/msg/tfMessage"


def open_bag(bag):
    path = pathlib.Path(bag)
    store = get_typestore(Stores.ROS2_HUMBLE)
    if not path.is_dir() or (path / "metadata.yaml").exists():
        return AnyReader([path], default_typestore=store)
    for kind in ("*.mcap", "*.db3", "*.bag"):  # of a recorder that was killed, or several of ROS 1
        if files := sorted(path.glob(kind)):
            return AnyReader(files, default_typestore=store)
    raise ValueError("a folder without metadata.yaml, .mcap, .db3 or .bag")


def stamp_ns(header):
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def short_type(msgtype):
    return msgtype.split("/")[-1]


def describe(reader, connection):
    """What the first message of a topic shows."""
    if short_type(connection.msgtype) not in ("JointState", "Image", "CompressedImage", "CameraInfo"):
        return {}
    for _, _, raw in reader.messages(connections=[connection]):
        message = reader.deserialize(raw, connection.msgtype)
        shown = {"frame": str(message.header.frame_id)}
        if short_type(connection.msgtype) == "JointState":
            shown["names"] = [str(name) for name in message.name[:MOST_NAMES]]
        elif short_type(connection.msgtype) == "Image":
            shown.update(encoding=str(message.encoding), width=int(message.width), height=int(message.height))
        elif short_type(connection.msgtype) == "CompressedImage":
            shown["format"] = str(message.format)
        else:
            shown["info"] = info_of(message)
        return shown
    return {}


def info_of(message):
    """A CameraInfo as ROS writes it; ROS 1 has capital letters."""
    def matrix(name):
        return [float(x) for x in getattr(message, name, getattr(message, name.upper(), []))]
    return {"width": int(message.width), "height": int(message.height),
            "distortion_model": str(message.distortion_model), **{key: matrix(key) for key in "kdrp"}}


def list_topics(records, reader):
    seen = {}
    for connection in reader.connections:
        if connection.topic in seen:
            seen[connection.topic]["count"] += connection.msgcount
            continue
        try:
            shown = describe(reader, connection) if connection.msgcount else {}
        except Exception as error:  # pylint: disable=broad-except
            shown = {"broken": " ".join(str(error).split())[:300]}
        seen[connection.topic] = {"topic": connection.topic, "type": connection.msgtype,
                                  "count": connection.msgcount, **shown}
    for topic in seen.values():
        records.write("topic", **topic)


class Transforms:
    """What tf says: of each pair of frames the first place, and whether it moves."""

    def __init__(self):
        self.of_pair = {}
        self.lost = 0

    def add(self, message, static):
        for entry in message.transforms:
            pair = (str(entry.header.frame_id).lstrip("/"), str(entry.child_frame_id).lstrip("/"))
            t, q = entry.transform.translation, entry.transform.rotation
            place = [float(x) for x in (t.x, t.y, t.z, q.x, q.y, q.z, q.w)]
            if not all(math.isfinite(x) for x in place):
                continue
            if pair not in self.of_pair:
                if len(self.of_pair) == MOST_TRANSFORMS:
                    self.lost += 1
                    continue
                self.of_pair[pair] = {"place": place, "static": static, "moves": False}
            known = self.of_pair[pair]
            if max(abs(a - b) for a, b in zip(place, known["place"])) > 1e-6:
                known["moves"] = True

    def write(self, records):
        for (parent, child), known in self.of_pair.items():
            records.write("transform", framing.numbers(known["place"]), parent=parent, child=child,
                          static=known["static"], moves=known["moves"])
        if self.lost:
            records.write("note", text=f"tf has more than {MOST_TRANSFORMS} pairs of frames; {self.lost} not looked at")


def write_joints(records, message, place):
    names = [str(name) for name in message.name]
    velocities = list(message.velocity)
    if len(velocities) != len(names):
        velocities = []
    records.write("joints", framing.numbers([*message.position, *velocities]), names=names,
                  positions=len(message.position), velocities=len(velocities), **place)


def write_picture(records, message, place):
    if hasattr(message, "encoding"):
        records.write("picture", bytes(message.data), encoding=str(message.encoding), width=int(message.width),
                      height=int(message.height), step=int(message.step), **place)
    else:
        records.write("compressed", bytes(message.data), format=str(message.format), **place)


def write_message(records, connection, arrival, message, infos):
    place = {"topic": connection.topic, "arrival_ns": int(arrival), "stamp_ns": stamp_ns(message.header)}
    kind = short_type(connection.msgtype)
    if kind == "JointState":
        write_joints(records, message, place)
    elif kind == "CameraInfo":
        info = info_of(message)
        if infos.get(connection.topic) != info:
            infos[connection.topic] = info
            records.write("camera_info", topic=connection.topic, info=info)
    else:
        write_picture(records, message, dict(place, frame=str(message.header.frame_id).lstrip("/")))


def read_messages(records, reader, wanted):
    chosen = set(wanted["joints"]) | set(wanted["pictures"]) | set(wanted["infos"])
    connections = [c for c in reader.connections
                   if c.topic in chosen or c.msgtype in (TRANSFORMS, ROS1_TRANSFORMS)]
    transforms = Transforms()
    infos = {}
    for connection, arrival, raw in reader.messages(connections=connections):
        try:
            message = reader.deserialize(raw, connection.msgtype)
            if connection.msgtype in (TRANSFORMS, ROS1_TRANSFORMS):
                transforms.add(message, connection.topic.endswith("tf_static"))
            else:
                write_message(records, connection, arrival, message, infos)
        except BrokenPipeError:
            raise
        except Exception as error:  # pylint: disable=broad-except  # one message of many
            records.write("broken", topic=connection.topic, message=" ".join(str(error).split())[:300])
    transforms.write(records)


def main(records):
    try:
        with open_bag(sys.argv[1]) as reader:
            if sys.argv[2] == "list":
                list_topics(records, reader)
            else:
                read_messages(records, reader, json.loads(sys.argv[3]))
    except (BrokenPipeError, MemoryError):
        raise
    except Exception as error:
        text = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise ValueError(f"no ROS bag that can be read to its end: {text}. One that was cut short is mended by "
                         "`ros2 bag reindex`, `mcap recover` or `rosbag reindex`") from error


if __name__ == "__main__":
    framing.run(main)
