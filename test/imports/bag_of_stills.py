"""Writes a ROS bag with what `bodyschema import stills` makes of a folder: rosbags' writer, for tests.

usage: bag_of_stills.py FOLDER BAG mcap|sqlite3|ros1 [KEY=VALUE ...]

FOLDER holds images/CAMERA/NN.{png,ppm}, joints.csv and possibly camera_info/CAMERA.yaml; each posture becomes one picture a camera and readings held
still around it, stamped as that import stamps them. Keys:
  encoding=rgb8|bgr8|rgba8|mono8   of the pictures
  compression=zstd                 of a ROS 2 bag's messages
  second_joints=1                  also a topic of commands with the same names
  no_stamps=1                      headers without stamps
  masks=1                          masks/CAMERA/NN as mono8 on /CAMERA/mask
  wide_info=1                      a CameraInfo of another focal length
  broken_picture=1                 one more picture whose data are too short
"""
import csv
import pathlib
import sys

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML

TRANSFORMS = "tf2_msgs/msg/TFMessage"
PERIOD_US, HOLD_US, STEP_US = 10_000_000, 250_000, 25_000


def read_picture(path):
    """Height x width x 3, RGB, or height x width."""
    data = path.read_bytes()
    if data[:2] in (b"P6", b"P5"):
        kind, width, height, _ = data.split(None, 4)[:4]
        channels = 3 if kind == b"P6" else 1
        size = int(width) * int(height) * channels
        picture = np.frombuffer(data[-size:], np.uint8).reshape(int(height), int(width), channels)
        return picture if channels == 3 else picture[:, :, 0]
    from PIL import Image  # pylint: disable=import-outside-toplevel  # only where the pictures are PNG
    picture = Image.open(path)
    return np.asarray(picture.convert("L" if picture.mode in ("L", "1") else "RGB"))


def encoded(picture, encoding):
    if encoding == "bgr8":
        return picture[:, :, ::-1]
    if encoding == "rgba8":
        return np.dstack([picture, np.full(picture.shape[:2], 7, np.uint8)])
    return picture


class Bag:
    def __init__(self, path, kind, keys):
        self.ros1 = kind == "ros1"
        self.keys = keys
        self.store = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        if self.ros1:
            self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", TRANSFORMS))
        if self.ros1:
            self.writer = Writer1(path)
        else:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(path, version=9, storage_plugin=plugin)
            if keys.get("compression") == "zstd":
                self.writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
        self.connections = {}
        self.sequence = 0

    def type(self, name):
        return self.store.types[name]

    def header(self, utime, frame):
        if self.keys.get("no_stamps"):
            utime = 0
        stamp = self.type("builtin_interfaces/msg/Time")(sec=utime // 1_000_000, nanosec=utime % 1_000_000 * 1000)
        extra = {}
        if self.ros1:
            self.sequence += 1
            extra["seq"] = self.sequence
        return self.type("std_msgs/msg/Header")(stamp=stamp, frame_id=frame, **extra)

    def write(self, topic, utime, message):
        kind = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], utime * 1000, serialize(message, kind))

    def joints(self, topic, utime, names, values):
        values = np.array(values, np.float64)
        self.write(topic, utime, self.type("sensor_msgs/msg/JointState")(
            header=self.header(utime, ""), name=names, position=values, velocity=np.zeros(len(names)),
            effort=np.zeros(0)))

    def picture(self, topic, utime, frame, picture, encoding, cut=0):
        pixels = np.ascontiguousarray(encoded(picture, encoding))
        data = pixels.reshape(-1)[:pixels.size - cut]
        self.write(topic, utime, self.type("sensor_msgs/msg/Image")(
            header=self.header(utime, frame), height=picture.shape[0], width=picture.shape[1], encoding=encoding,
            is_bigendian=0, step=pixels.size // picture.shape[0], data=data))

    def info(self, topic, utime, frame, width, height, known, focal):
        """As `known` (a CameraInfo) says, or a simple lens."""
        letters = str.upper if self.ros1 else str.lower
        k = np.array([focal, 0, (width - 1) / 2, 0, focal, (height - 1) / 2, 0, 0, 1.0])
        simple = {"d": np.zeros(5), "k": k, "r": np.eye(3).reshape(-1), "p": np.insert(k, [3, 6, 9], 0.0)}
        matrices = {letters(key): np.array(known.get(key, simple[key]), np.float64) for key in "dkrp"}
        roi = self.type("sensor_msgs/msg/RegionOfInterest")(
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        self.write(topic, utime, self.type("sensor_msgs/msg/CameraInfo")(
            header=self.header(utime, frame), height=height, width=width, **matrices,
            distortion_model=known.get("distortion_model", "plumb_bob"),
            binning_x=0, binning_y=0, roi=roi))

    def transform(self, topic, utime, parent, child, xyz):
        point = self.type("geometry_msgs/msg/Vector3")(x=xyz[0], y=xyz[1], z=xyz[2])
        turn = self.type("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=0.0, w=1.0)
        entry = self.type("geometry_msgs/msg/TransformStamped")(
            header=self.header(utime, parent), child_frame_id=child,
            transform=self.type("geometry_msgs/msg/Transform")(translation=point, rotation=turn))
        self.write(topic, utime, self.type(TRANSFORMS)(transforms=[entry]))


def file_of(folder, number):
    files = [f for f in folder.iterdir() if f.stem == f"{number:02d}"] if folder.is_dir() else []
    return files[0] if files else None


def camera_info(folder, camera):
    file = folder / "camera_info" / (camera + ".yaml")
    return YAML(typ="safe").load(file.read_text(encoding="utf-8")) if file.exists() else {}


def add_posture(bag, folder, utime, number, names, values):
    encoding = bag.keys.get("encoding", "rgb8")
    cameras = sorted(d.name for d in (folder / "images").iterdir())
    for t in range(utime - HOLD_US, utime + HOLD_US + 1, STEP_US):
        bag.joints("/joint_states", t, names, values)
        if bag.keys.get("second_joints"):
            bag.joints("/joint_commands", t, names, values)
        if t != utime:
            continue
        for camera in cameras:
            path = file_of(folder / "images" / camera, number)
            if path is None:
                continue
            picture, frame = read_picture(path), camera + "_optical"
            height, width = picture.shape[:2]
            bag.info(f"/rig/{camera}/camera_info", utime, frame, width, height, camera_info(folder, camera),
                     width * (2.0 if bag.keys.get("wide_info") else 1.0))
            bag.picture(f"/rig/{camera}/image_rect", utime, frame, picture, encoding)
        for camera in cameras if bag.keys.get("masks") else []:
            path = file_of(folder / "masks" / camera, number)
            if path is not None:
                bag.picture(f"/{camera}/mask", utime, "", read_picture(path), "mono8")


def main():
    folder, path, kind = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    keys = dict(argument.split("=", 1) for argument in sys.argv[4:])
    with open(folder / "joints.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = [name for name in rows[0] if name not in ("posture", "frame")]
    bag = Bag(path, kind, keys)
    with bag.writer:
        bag.transform("/tf_static", PERIOD_US - HOLD_US, "base", "left_optical", [0.1, 0.2, 0.3])
        bag.transform("/tf", PERIOD_US - HOLD_US, "hand", "right_optical", [0.0, 0.0, 0.1])
        bag.transform("/tf", PERIOD_US, "hand", "right_optical", [0.0, 0.0, 0.2])
        for i, row in enumerate(rows):
            add_posture(bag, folder, (i + 1) * PERIOD_US, int(row.get("posture", i)), names,
                        [float(row[name]) for name in names])
        if keys.get("broken_picture"):
            last = (len(rows) + 1) * PERIOD_US
            bag.picture("/rig/left/image_rect", last, "", np.zeros((6, 8, 3), np.uint8), "rgb8", cut=5)


if __name__ == "__main__":
    main()
