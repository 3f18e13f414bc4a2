"""Runs an example of docs/examples against a peer from here; exit 77 means skipped.

usage: python_example.py EXAMPLE_PY TYPES_DIR VENV_DIR
"""
import os
import pathlib
import random
import select
import subprocess
import sys
import time

from python_packages import SKIPPED, python_with

# For listen.py: sends, and what it must print.
SEND = """
import lcm, math, sys, time
from bodyschema import finding_t, findings_t, joint_offsets_t
found = findings_t()
found.num_findings = 1
found.finding = [finding_t()]
found.finding[0].sentence = "pictures arrive 58 ms late"
found.finding[0].num_alike = 1
found.finding[0].alike = ["backlash of r_elbow"]
message = joint_offsets_t()
message.num_joints = 2
message.joint_name = ["r_elbow", "r_wrist_yaw"]
message.mean_rad = [math.radians(-2.0), math.radians(3.25)]
message.covariance_rad2 = [[1.0, 0.0], [0.0, 1.0]]
message.told = [1, 1]
bus = lcm.LCM()
while True:
    for message.state in ("converged", "diverged"):
        bus.publish("ICUB_JOINT_OFFSETS", message.encode())
        bus.publish("ICUB_FINDINGS", found.encode())
        time.sleep(0.1)
"""
HEARD = {"r_elbow -2.00 r_wrist_yaw +3.25", "diverged: not to be used",
         "the pictures ask for: pictures arrive 58 ms late or backlash of r_elbow"}

# For publish.py: prints what was received.
RECEIVE = """
import lcm
from bot_core import images_t, joint_state_t
def joints(channel, data):
    m = joint_state_t.decode(data)
    print("joints", *m.joint_name, *(f"{p:.1f}" for p in m.joint_position), m.utime > 10**15, flush=True)
def images(channel, data):
    m = images_t.decode(data)
    print("images", *m.image_types, *(f"{i.width}x{i.height}:{len(i.data)}" for i in m.images), flush=True)
bus = lcm.LCM()
bus.subscribe("ICUB_JOINT_STATE", joints)
bus.subscribe("ICUB_CAMERAS", images)
while True:
    bus.handle()
"""
# For masks.py: pictures of 2x2 px, one pixel bright, in each of the ways they travel, and what must come back.
PICTURES = """
import lcm, io, time
import numpy as np
from PIL import Image
from bot_core import image_t, images_t
def message(kind, data, stride=0):
    image = image_t()
    image.width, image.height, image.row_stride, image.pixelformat = 16, 16, stride, kind
    image.data, image.size = data, len(data)
    return image
rgb = np.zeros((16, 16, 3), np.uint8)
rgb[:, 8:] = [250, 250, 200]
jpeg = io.BytesIO()
Image.fromarray(rgb).save(jpeg, "JPEG", quality=95)
padded = np.zeros((16, 20), np.uint8)
padded[:, :16] = rgb[:, :, 0]
images = images_t()
images.images = [message(image_t.PIXEL_FORMAT_RGB, rgb.tobytes()), message(image_t.PIXEL_FORMAT_GRAY, padded.tobytes(), 20),
                 message(image_t.PIXEL_FORMAT_MJPEG, jpeg.getvalue()), message(-5, b"")]
images.n_images, images.image_types, images.utime = 4, [0, 1, 7, 8], 1234
images.images[0].utime = 1200
bus = lcm.LCM()
while True:
    bus.publish("ICUB_CAMERAS", images.encode())
    time.sleep(0.1)
"""
MASKS = """
import lcm
from bot_core import images_t
def masks(channel, data):
    m = images_t.decode(data)
    for camera, mask in zip(m.image_types, m.images):
        print("mask", camera, mask.utime, f"{mask.width}x{mask.height}", sorted(set(mask.data)), mask.data[2], mask.data[14],
              flush=True)
bus = lcm.LCM()
bus.subscribe("ICUB_MASKS", masks)
while True:
    bus.handle()
"""
MASKED = {f"mask {camera} {utime} 16x16 [0, 255] 0 255" for camera, utime in ((0, 1200), (1, 1234), (7, 1234))}
SENT = {"joints r_elbow r_wrist_yaw 0.8 0.1 True", "images 0 1 320x240:76800 320x240:76800"}


def main():
    example, types, directory = (pathlib.Path(a) for a in sys.argv[1:4])
    python = python_with(directory, "lcm", "numpy", "PIL")
    if python is None:
        return SKIPPED
    environment = dict(os.environ, PYTHONPATH=str(types), PYTHONDONTWRITEBYTECODE="1",
                       LCM_DEFAULT_URL=f"udpm://239.255.76.67:{random.randint(40000, 60000)}?ttl=0")
    sends, hears, expected, between = {
        "publish.py": ([example], ["-c", RECEIVE], SENT, None),
        "listen.py": (["-c", SEND], [example], HEARD, None),
        "masks.py": (["-c", PICTURES], ["-c", MASKS], MASKED, [example, "--stand-in"]),
    }[example.name]
    beside = subprocess.Popen([python, *between], env=environment) if between else None
    sender = subprocess.Popen([python, *sends], env=environment, stderr=subprocess.PIPE, text=True)
    listener = subprocess.Popen([python, *hears], env=environment, text=True, stdout=subprocess.PIPE)
    lines = set()
    try:
        # A listener that hears nothing blocks for ever; half a minute is enough on a busy machine.
        end = time.monotonic() + 30.0
        while lines != expected and select.select([listener.stdout], [], [], max(0.0, end - time.monotonic()))[0]:
            lines.add(listener.stdout.readline().strip())
        if not lines and sender.poll() is not None and "multicast" in (error := sender.stderr.read()).lower():
            print(f"no multicast here, skipped: {error}")
            return SKIPPED
    finally:
        for process in filter(None, (sender, listener, beside)):
            process.kill()
            process.wait()
    print("\n".join(sorted(lines)))
    return 0 if lines == expected else 1


if __name__ == "__main__":
    sys.exit(main())
