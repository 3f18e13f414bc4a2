"""Runs docs/examples/listen.py against messages sent here; exit 77 means skipped.

usage: python_example.py LISTEN_PY TYPES_DIR VENV_DIR
"""
import os
import pathlib
import random
import select
import subprocess
import sys

from python_packages import SKIPPED, python_with

SEND = """
import lcm, math, sys, time
from bodyschema import joint_offsets_t
message = joint_offsets_t()
message.state = "tracking"
message.num_joints = 2
message.joint_name = ["r_elbow", "r_wrist_yaw"]
message.mean_rad = [math.radians(-2.0), math.radians(3.25)]
message.covariance_rad2 = [[1.0, 0.0], [0.0, 1.0]]
bus = lcm.LCM()
while True:
    bus.publish("ICUB_JOINT_OFFSETS", message.encode())
    time.sleep(0.1)
"""


def main():
    listen, types, directory = (pathlib.Path(a) for a in sys.argv[1:4])
    python = python_with(directory, "lcm")
    if python is None:
        return SKIPPED
    environment = dict(os.environ, PYTHONPATH=str(types), PYTHONDONTWRITEBYTECODE="1",
                       LCM_DEFAULT_URL=f"udpm://239.255.76.67:{random.randint(20000, 40000)}?ttl=0")
    sender = subprocess.Popen([python, "-c", SEND], env=environment, stderr=subprocess.PIPE, text=True)
    listener = subprocess.Popen([python, listen], env=environment, text=True,
                                stdout=subprocess.PIPE)
    line = ""
    try:
        # A listener that hears nothing blocks for ever; half a minute is enough on a busy machine.
        if select.select([listener.stdout], [], [], 30.0)[0]:
            line = listener.stdout.readline().strip()
        elif sender.poll() is not None and "multicast" in (error := sender.stderr.read()).lower():
            print(f"no multicast here, skipped: {error}")
            return SKIPPED
    finally:
        for process in (sender, listener):
            process.kill()
            process.wait()
    print(line)
    return 0 if line == "tracking r_elbow -2.00 r_wrist_yaw +3.25" else 1


if __name__ == "__main__":
    sys.exit(main())
