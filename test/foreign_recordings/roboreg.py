#!/usr/bin/env python3
"""Three recordings of physical arms, tried when nearly all of `calibrate` was written, and what it says of them.

They are in the history of github.com/lbr-stack/roboreg (Apache-2.0), each with masks by SAM 2 and one camera:

  xarm      UFACTORY xArm 7, Intel RealSense, 1280x720, ten postures; another arm in view
  lbr_tool  KUKA LBR Med7, Intel RealSense, 1280x720, eleven postures, some half out of view; a tool on the flange
  lbr_near  KUKA LBR Med7, ZED 2i, one camera, 960x540, seven postures

usage: roboreg.py CLONE OUT --robots lbr=URDF xarm=URDF [--sets ...] [--seeds N] [--postures N] [--no-masks]
                  [--reversed] [--replay]

CLONE is a clone of that repository. LBR's URDF comes with this project's test data; the xArm's is made by xacro from
github.com/xArm-Developer/xarm_ros (meshes xarm7/visual, its default kinematics).

Offsets of 4 deg standard deviation are added to the recorded angles, none with the first seed, and nothing is told to
the three commands but URDF and folder. Printed for each: state, joints told, errors of these but the first against the
encoders as they are (rms, and the worst in published standard deviations and 0.1 deg), and the outlines' distance in
the masks on postures left out. `--postures` draws so many with each seed. `--reversed` turns the sign of one joint's
angles after the other instead, which should not be `good`. `--replay` plays each calibrated log through the service's
code, with the cameras that were found, and prints how that ends. Exit status 1 where a result is `good` and wrong: a
told joint off by more than 5 standard deviations, or by more than 3 and 0.5 deg. Needs git and numpy.
"""
import argparse
import csv
import io
import json
import math
import pathlib
import random
import shutil
import subprocess
import sys

import numpy as np

SOURCE = pathlib.Path(__file__).resolve().parents[2]
XARM = [f"joint{i}" for i in range(1, 8)]
LBR = [f"lbr_A{i}" for i in range(1, 8)]
SETS = {
    "xarm": {"robot": "xarm", "at": "a155508:test/data/xarm/realsense", "postures": 10, "joints": XARM,
             "image": "img_{}.png", "mask": "mask_sam2_img_{}.png", "angles": "joint_state_{}.npy"},
    "lbr_tool": {"robot": "lbr", "at": "c18d100:test/data/lbr_med7/realsense", "postures": 11, "joints": LBR,
                 "image": "image_{}.png", "mask": "mask_{}.png", "angles": "joint_states_{}.npy"},
    "lbr_near": {"robot": "lbr", "at": "d42d5eb:test/data/lbr_med7/zed2i/high_res", "postures": 7, "joints": LBR,
                 "image": "image_{}.png", "mask": "mask_{}.png", "angles": "joint_states_{}.npy"},
}
OFFSET_SD_DEG = 4.0
TAKEN_FOR_RIGHT_DEG = 0.1  # the arms' own encoders


def lay_out(clone, recording, folder):
    """Pictures, masks and intrinsics as `import stills` reads them. Returns the recorded angles, rad, a row each."""
    def content(name):
        return subprocess.run(["git", "-C", clone, "show", f"{recording['at']}/{name}"], check=True,
                              capture_output=True).stdout
    for kind in ("images", "masks"):
        (folder / kind / "left").mkdir(parents=True)
    (folder / "camera_info").mkdir()
    (folder / "camera_info/left.yaml").write_bytes(content("camera_info.yaml"))
    rows = []
    for i in range(recording["postures"]):
        (folder / f"images/left/{i:02d}.png").write_bytes(content(recording["image"].format(i)))
        (folder / f"masks/left/{i:02d}.png").write_bytes(content(recording["mask"].format(i)))
        rows.append(np.load(io.BytesIO(content(recording["angles"].format(i)))))
    return np.array(rows)


def calibrate(program, urdf, recorded, angles, joints, folder, masks):
    """The three commands on the pictures of some postures, with these angles (by posture). Returns calibration.json."""
    shutil.rmtree(folder, ignore_errors=True)
    stills = folder / "stills"
    for kind in ("images", "masks"):
        (stills / kind / "left").mkdir(parents=True)
        for i in angles:
            picture = f"{kind}/left/{i:02d}.png"
            (stills / picture).symlink_to((recorded / picture).resolve())
    (stills / "camera_info").symlink_to((recorded / "camera_info").resolve())
    with open(stills / "joints.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["posture", *joints])
        writer.writerows([i, *row] for i, row in angles.items())
    without = [] if masks else ["--no-masks"]
    estimator = folder / "arm/estimator.yaml"
    for command in (["new-robot", urdf, "--stills", stills, "--out", folder / "arm", *without],
                    ["import", "stills", stills, "--config", estimator, "--out", folder / "log", *without],
                    ["calibrate", folder / "log", "--config", estimator, "--out", folder / "out"]):
        done = subprocess.run([program, *command], capture_output=True, text=True)
        if done.returncode not in (0, 3):
            raise SystemExit(f"{' '.join(map(str, command))}: {done.stderr}")
    return json.loads((folder / "out/calibration.json").read_text())


def replay(program, folder, result):
    """What the service's code says at the end of a calibrated log, as text."""
    command = [program, "replay", folder / "log", "--config", folder / "out/estimator.yaml", "--out", folder / "replay"]
    subprocess.run(command, capture_output=True, check=True)
    last = json.loads((folder / "replay/estimates.jsonl").read_text().splitlines()[-1])
    apart = [abs(last["offset_deg"][joint] - result["offset_deg"][joint]) for joint in result["told"]]
    return (f"  replayed: {last['state']}, hand {last['hand_sd_mm']:.1f} mm (limit {last['hand_sd_limit_mm']:.1f}), told "
            f"offsets {max(apart, default=math.nan):.2f} deg from these at most")


def line_of(name, tag, result, hidden_deg):
    """What is printed of a result, and whether it is `good` and wrong."""
    first, *others = result["offset_deg"]
    told = [joint for joint in others if joint in result["told"]]
    errors = {joint: result["offset_deg"][joint] - hidden_deg[joint] for joint in told}
    published = {joint: result["stddev_deg"][joint] for joint in told}
    of_sd = {joint: abs(e) / math.hypot(published[joint], TAKEN_FOR_RIGHT_DEG) for joint, e in errors.items()}
    rms = math.sqrt(sum(e * e for e in errors.values()) / max(1, len(errors)))
    heldout = result["outline_px"].get("heldout")
    wrong = result["state"] == "good" and any(
        of_sd[joint] > 5 or (of_sd[joint] > 3 and abs(errors[joint]) > 0.5) for joint in told)
    return (f"{name:9} {tag:>8} {result['state']:14} told {len(told) + (first in result['told'])}  rms {rms:5.2f} deg  "
            f"worst {max(of_sd.values(), default=0.0):4.1f} sd  outlines {heldout or math.nan:5.2f} px"
            f"{'  WRONG' if wrong else ''}"), wrong, errors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clone")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--robots", nargs="+", required=True, metavar="NAME=URDF")
    parser.add_argument("--sets", nargs="+", choices=SETS, default=list(SETS))
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--postures", type=int)
    parser.add_argument("--no-masks", action="store_true")
    parser.add_argument("--reversed", action="store_true")
    parser.add_argument("--replay", action="store_true")
    parser.add_argument("--program", default=str(SOURCE / "build/release/bin/bodyschema"))
    arguments = parser.parse_args()
    robots = dict(robot.split("=", 1) for robot in arguments.robots)
    any_wrong = False
    for name in arguments.sets:
        recording = SETS[name]
        joints = recording["joints"]
        folder = arguments.out / name
        shutil.rmtree(folder, ignore_errors=True)
        angles = lay_out(arguments.clone, recording, folder / "recorded")

        def played(tag, changed):
            return calibrate(arguments.program, robots[recording["robot"]], folder / "recorded", changed, joints,
                             folder / tag, not arguments.no_masks)

        every = range(recording["postures"])
        if arguments.reversed:
            for k, joint in enumerate(joints):
                turned = angles.copy()
                turned[:, k] *= -1
                result = played(joint, dict(zip(every, turned)))
                print(f"{name:9} {joint:>8} turned round  {result['state']:14} {joint} is "
                      f"{'told' if joint in result['told'] else 'not told'}", flush=True)
            continue
        found = []
        for seed in range(arguments.seeds):
            source = random.Random(seed)
            hidden = [source.gauss(0.0, OFFSET_SD_DEG) if seed > 0 else 0.0 for _ in joints]
            shown = sorted(source.sample(every, arguments.postures or len(every)))
            result = played(str(seed), {i: angles[i] + np.radians(hidden) for i in shown})
            line, wrong, errors = line_of(name, str(seed), result, dict(zip(joints, hidden)))
            print(line + (replay(arguments.program, folder / str(seed), result) if arguments.replay else ""), flush=True)
            any_wrong |= wrong
            if result["state"] == "good":
                found.append(errors)
        always = set.intersection(*map(set, found)) if found else set()
        apart = [max(e[joint] for e in found) - min(e[joint] for e in found) for joint in always]
        print(f"{name:9} good answers to different offsets lie within {max(apart, default=math.nan):.2f} deg of each "
              f"other, in {len(always)} joints told by all of them")
    return 1 if any_wrong else 0


if __name__ == "__main__":
    sys.exit(main())
