#!/usr/bin/env python3
"""Any URDF arm that moves before cameras that stand, drawn by MuJoCo, and what the service says of its log.

The scenes of foreign_stills.py, with the arm in motion: reaches between postures in view, minimum jerk, a second of
rest in each. Encoders and pictures go into an LCM log, `bodyschema new-robot` writes the configuration from URDF and
camera_info as a user would, and `bodyschema replay` runs the service's estimator on it.

usage: foreign_arms.py play URDF CONDITION SEED FOLDER      a log, its truth, and a sheet of pictures
       foreign_arms.py table FOLDER --robots NAME=URDF ... [--conditions ...] [--seeds ...] [--cameras KIND ...]

`table` plays what is not in FOLDER yet and prints for each log: mean error of the last link's place in the left camera
in frames called `converged` (where none is, in the last 50), the share of frames called so from frame 45 on, how many
of all called so are wrong, early ones too (hand beyond 3 of its standard deviations and 2 mm, or an offset beyond 5),
and of the others from frame 45 on how many have a wrong hand. Exit status 1 where a `converged` frame is wrong. Where
the configuration has the cameras (--cameras): `exact` where they are; `measured` 5 mm and 0.5 deg off, as a hand-eye
calibration; `wrong` 3 cm and 3 deg off; `roughly` the same, and it says so. What else it says of them is as new-robot
writes it.

Needs what foreign_simulator.py needs.
"""
import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys

from foreign_simulator import (DEG, ENCODERS_HZ, FIRST_COUNTED, SOURCE, START_US, between, cv2, joint_message, lcm, np,
                               picture_message, rotation)
from foreign_stills import Stills, Urdf, pose_of, write_camera_info, yaml

PLAIN = {"postures": 14, "size": (640, 480), "focal": 610.0, "spread_deg": 60, "seconds": 24, "hz": 5, "rest": 1.0,
         "fastest_deg_s": 45}
FULL = {"tool": True, "twin": True, "covered": True}
CONDITIONS = {
    "room": {},
    "full": FULL,  # a tool that no URDF has, another arm of the same make, half the base covered
    "mono": {**FULL, "cameras": "mono"},
    "apart": {**FULL, "cameras": "apart"},
    "hd": {**FULL, "size": (1280, 720), "focal": 910.0},
    "grey": {**FULL, "looks": "grey"},
    "pale": {**FULL, "looks": "white", "wall": [0.82, 0.82, 0.8]},
    "dark": {**FULL, "light": 0.25, "noise": 2.5},
    "far": {**FULL, "offset_sd_deg": 8},
    "jpeg": {**FULL, "jpeg": 70},
    "lens": {**FULL, "k1": -0.12},
    "focal": {**FULL, "focal_percent": 1.5},
    "beside2": {**FULL, "beside_mm": 2},
    "late": {**FULL, "late_ms": 60},
    "moved": {**FULL, "moved": True},
}


class Arm(Stills):
    """Postures of a still, one after another, and the way between."""

    def __init__(self, urdf, condition, seed):
        super().__init__(urdf, {**PLAIN, **condition}, seed)
        self.mount = self.bare.urdf.root  # what the cameras sit on
        self.held = [name for name, joint in self.bare.urdf.joints.items() if name not in self.joints
                     and name not in self.bare.urdf.mimics and joint.get("type") in ("revolute", "prismatic")]
        self.plan()

    def plan(self):
        self.knots, t = [], 0.0
        order = list(range(len(self.postures)))
        last = self.postures[order[0]]
        self.knots.append((0.0, self.condition["rest"], last, last))
        t = self.condition["rest"]
        k = 1
        while t < self.condition["seconds"] + 3:
            target = self.postures[order[k % len(order)]]
            most = max(abs(target[j] - last[j]) for j in self.joints)
            move = max(0.8, 1.875 * most / (self.condition["fastest_deg_s"] * DEG))
            self.knots.append((t, t + move, last, target))
            t += move
            self.knots.append((t, t + self.condition["rest"], target, target))
            t, last, k = t + self.condition["rest"], target, k + 1

    def at(self, t):
        for begin, end, a, b in self.knots:
            if t < end:
                s = max(0.0, (t - begin) / (end - begin))
                return between(a, b, s**3 * (10 - 15 * s + 6 * s * s))
        return dict(self.knots[-1][3])

    def place(self, t):
        angles = self.at(t)
        self.scene.set_joints(angles)
        return angles

    def play(self, out):
        out.mkdir(parents=True, exist_ok=True)
        c = self.condition
        log = lcm.EventLog(str(out / "log.lcmlog.part"), "w", overwrite=True)
        truth = {"offsets_deg": self.offsets, "frames": [], "mount": self.mount, "cameras": {
            n: k["X_base_optical"].tolist() for n, k in self.cameras.items()}}
        sheet, step = [], 2 * math.pi / 2**15
        steps, late = ENCODERS_HZ // c["hz"], c.get("late_ms", 0) * 1e-3
        frames = 0
        for k in range(int(c["seconds"] * ENCODERS_HZ)):
            t = k / ENCODERS_HZ
            utime = START_US + round(1e6 * t)
            angles = self.at(t)
            values = [angles[j] + self.offsets[j] * DEG + self.random.normal(0, 0.01 * DEG) for j in self.joints]
            log.write_event(utime, "ROBOT_JOINT_STATE",
                            joint_message(self.joints + self.held,
                                          [round(v / step) * step for v in values] + [0.0] * len(self.held), utime))
            if k % steps:
                continue
            if c.get("moved") and frames % 20 == 0:
                self.scene.move_things()
            shown = self.place(max(0.0, t - late))
            pictures = [self.scene.picture(n) for n in self.cameras]
            truth["frames"].append({"utime": utime, "rad": shown})
            log.write_event(utime + 4000, "ROBOT_CAMERAS", picture_message(pictures, utime, c.get("jpeg", 0)))
            if frames % (c["seconds"] * c["hz"] // 12) == 0:
                both = np.hstack(pictures)
                sheet.append(cv2.resize(both, (640, 640 * both.shape[0] // both.shape[1])))
            frames += 1
        log.close()
        rows = [np.hstack(sheet[i:i + 3]) for i in range(0, len(sheet) - len(sheet) % 3, 3)]
        cv2.imwrite(str(out / "sheet.png"), np.vstack(rows)[..., ::-1])
        for name, camera in self.cameras.items():
            write_camera_info(out / f"{name}.yaml", name, camera,
                              camera["f"] / (1 + 1e-2 * c.get("focal_percent", 0)))
        self.write_poses(out / "camera_pose.json")
        (out / "truth.json").write_text(json.dumps(truth))
        (out / "log.lcmlog.part").rename(out / "log.lcmlog")

    def write_poses(self, file):
        """Where configurations have the cameras; both are off alike, as one tripod is."""
        by_kind = {}
        for kind, deg, m in (("exact", 0, 0), ("measured", 0.5, 0.005), ("roughly", 3, 0.03), ("wrong", 3, 0.03)):
            turned, moved = rotation(self.random.normal(0, deg * DEG, 3)), self.random.normal(0, m, 3)
            by_kind[kind] = {}
            for name, camera in self.cameras.items():
                X = camera["X_base_optical"].copy()
                X[:3, :3] = turned @ X[:3, :3]
                X[:3, 3] += moved
                by_kind[kind][name] = X.tolist()
        file.write_text(json.dumps({"base_link": self.mount, "cameras": list(self.cameras),
                                    "X_base_optical": by_kind}))


# ---- what the product says of it -----------------------------------------------------------------

def replay(program, urdf, folder, kind, tag, believed, settings, described=()):
    """As docs/calibrate_my_robot.md has it; `described` is told new-robot besides.
    @return the folder of the replay, or what went wrong."""
    out = folder / f"{kind}{tag}"
    shutil.rmtree(out, ignore_errors=True)
    truth = json.loads((folder / "truth.json").read_text())
    cameras = list(truth["cameras"])
    info = [a for n in cameras for a in ("--camera-info", folder / f"{n}.yaml")]
    believed = believed or ((30, 3) if kind == "roughly" else None)
    rough = [a for n in cameras if believed
             for a in ("--set", f"cameras.{n}.pose=roughly", "--set", f"cameras.{n}.pose_sd_mm={believed[0]}",
                       "--set", f"cameras.{n}.pose_sd_deg={believed[1]}")]
    poses = [] if "--camera" in described else ["--camera-pose", f"{folder}/camera_pose.json:{kind}"]
    commands = [["new-robot", urdf, *info, *poses, *described, "--out", out],
                ["replay", folder / "log.lcmlog", "--config", out / "estimator.yaml", *rough,
                 *(a for key in settings for a in ("--set", key)), "--out", out / "replay"]]
    for command in commands:
        done = subprocess.run([str(program), *map(str, command)], capture_output=True, text=True)
        out.mkdir(parents=True, exist_ok=True)
        (out / f"{command[0]}.txt").write_text(done.stdout + done.stderr)
        if done.returncode not in (0, 3):
            return (done.stderr or done.stdout).strip().splitlines()[-1]
    return out / "replay"


def score(out, urdf, truth):
    link = yaml.safe_load((out.parent / "robot.yaml").read_text())["robot"]["hand_link"]
    tree, X = Urdf(urdf, [urdf.parent, *urdf.parents]), np.array(truth["cameras"]["left"])
    true = {f["utime"]: np.linalg.inv(pose_of(tree, truth.get("mount", tree.root), f["rad"]) @ X)
            @ pose_of(tree, link, f["rad"]) for f in truth["frames"]}
    offsets, order = truth["offsets_deg"], {u: k for k, u in enumerate(sorted(true))}
    converged, others, wrong, wrong_others, silent, hands, e = [], [], 0, 0, 0, [], {}
    for line in (out / "estimates.jsonl").open():
        e = json.loads(line)
        early = order[e["utime"]] < FIRST_COUNTED
        if "hand_pose_left_camera" not in e or e.get("hand_sd_mm") is None:
            silent += not early
            continue
        off = 1e3 * np.linalg.norm(np.array(e["hand_pose_left_camera"])[:3, 3] - true[e["utime"]][:3, 3])
        sd = e["hand_sd_mm"]
        bad = off > max(2, 3 * sd)
        if e["state"] == "converged":  # a promise from the first on
            wrong += bad or any(abs(e["offset_deg"][j] - offsets[j]) > 5 * e["stddev_deg"][j]
                                for j in offsets if j in e["offset_deg"])
        if early:
            continue
        if e["state"] == "converged":
            converged.append(off)
        else:
            others.append(off)
            wrong_others += bad
        hands.append((off, sd))
    told = [j for j in e.get("told", []) if j in offsets]
    z = [abs(e["offset_deg"][j] - offsets[j]) / math.hypot(e["stddev_deg"][j], 0.1) for j in told]
    last = hands[-1] if hands else (math.nan, math.nan)
    return {"hand": np.mean(converged or others[-50:] or [math.nan]), "converged": len(converged),
            "frames": len(converged) + len(others) + silent, "wrong": wrong, "others": len(others), "last": last,
            "wrong_others": wrong_others, "told": len(told), "of": len(offsets), "z": max(z, default=math.nan),
            "state": e.get("state", "nothing published"), "said": " ".join(
                line for line in (out.parent / "replay.txt").read_text().splitlines() if "NOT CONVERGED" in line)}


def table(arguments, player=Arm, conditions=None, described=lambda name, kind: ()):
    conditions = conditions or CONDITIONS
    print(f"{'log':<26} {'hand, mm':>8} {'converged':>9} {'wrong':>6} {'others wrong':>12} {'last hand (sd)':>16} "
          f"{'told':>7} {'error/sd':>8}  last state")
    bad = 0
    for robot in arguments.robots:
        name, _, urdf = robot.partition("=")
        urdf = pathlib.Path(urdf).resolve()
        for condition in arguments.conditions:
            for seed in arguments.seeds:
                folder = arguments.folder / f"{condition}-{name}-{seed}"
                if not (folder / "truth.json").exists():
                    player(urdf, conditions[condition], seed).play(folder)
                truth = json.loads((folder / "truth.json").read_text())
                for kind in arguments.cameras:
                    out = replay(arguments.program, urdf, folder, kind, arguments.tag, arguments.believed,
                                 arguments.set, described(name, kind))
                    row = f"{folder.name}/{kind}"
                    if isinstance(out, str):
                        print(f"{row:<26} {out}", flush=True)
                        continue
                    s = score(out, urdf, truth)
                    bad += s["wrong"] > 0
                    print(f"{row:<26} {s['hand']:>8.2f} {s['converged']:>4}/{s['frames']:<4} {s['wrong']:>6} "
                          f"{s['wrong_others']:>5}/{s['others']:<4}  {s['last'][0]:>7.2f} ({s['last'][1]:>5.2f}) "
                          f"{s['told']:>2} of {s['of']:<2} {s['z']:>7.1f}  {s['state']} {s['said'][:90]}", flush=True)
    return 1 if bad else 0


def arguments_of(text, conditions):
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("play")
    one.add_argument("urdf", type=pathlib.Path)
    one.add_argument("condition", choices=sorted(conditions))
    one.add_argument("seed", type=int)
    one.add_argument("folder", type=pathlib.Path)
    rows = commands.add_parser("table")
    rows.add_argument("folder", type=pathlib.Path)
    rows.add_argument("--robots", nargs="+", required=True, metavar="NAME=URDF")
    rows.add_argument("--conditions", nargs="+", default=list(conditions))
    rows.add_argument("--seeds", nargs="+", type=int, default=[1])
    rows.add_argument("--cameras", nargs="+", default=["measured"], choices=["exact", "measured", "roughly", "wrong"])
    rows.add_argument("--program", default=str(SOURCE / "build/release/bin/bodyschema"))
    rows.add_argument("--believed", nargs=2, type=float, metavar=("MM", "DEG"), help="pose: roughly with these")
    rows.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="of the replay")
    rows.add_argument("--tag", default="", help="added to the names of the folders of replays")
    return parser.parse_args()


def main():
    arguments = arguments_of(__doc__, CONDITIONS)
    if arguments.command == "table":
        return table(arguments)
    Arm(arguments.urdf.resolve(), CONDITIONS[arguments.condition], arguments.seed).play(arguments.folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
