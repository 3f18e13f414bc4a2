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
from bodyschema import joint_offsets_t
message = joint_offsets_t()
message.num_joints = 2
message.joint_name = ["r_elbow", "r_wrist_yaw"]
message.mean_rad = [math.radians(-2.0), math.radians(3.25)]
message.covariance_rad2 = [[1.0, 0.0], [0.0, 1.0]]
bus = lcm.LCM()
while True:
    for message.state in ("converged", "diverged"):
        bus.publish("ICUB_JOINT_OFFSETS", message.encode())
        time.sleep(0.1)
"""
HEARD = {"r_elbow -2.00 r_wrist_yaw +3.25", "diverged: not to be used"}

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
SENT = {"joints r_elbow r_wrist_yaw 0.8 0.1 True", "images 0 1 320x240:76800 320x240:76800"}


def main():
    example, types, directory = (pathlib.Path(a) for a in sys.argv[1:4])
    python = python_with(directory, "lcm")
    if python is None:
        return SKIPPED
    environment = dict(os.environ, PYTHONPATH=str(types), PYTHONDONTWRITEBYTECODE="1",
                       LCM_DEFAULT_URL=f"udpm://239.255.76.67:{random.randint(20000, 40000)}?ttl=0")
    publishes = example.name == "publish.py"
    sends, hears = ([example], ["-c", RECEIVE]) if publishes else (["-c", SEND], [example])
    expected = SENT if publishes else HEARD
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
        for process in (sender, listener):
            process.kill()
            process.wait()
    print("\n".join(sorted(lines)))
    return 0 if lines == expected else 1


if __name__ == "__main__":
    sys.exit(main())
