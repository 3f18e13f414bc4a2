"""Bags written by rosbags, imported by the program; exit 77 means skipped.

usage: ros_bag_import.py PROGRAM SOURCE_DIR VENV_DIR SCRATCH_DIR [real]
With `real`: the stills of $BODYSCHEMA_DATA/real/lbr_zed5 as a folder and as a bag give the same estimates.
"""
import os
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "install"))
from python_packages import SKIPPED, python_with  # noqa: E402  # pylint: disable=wrong-import-position

KINDS = {"mcap": "bag", "sqlite3": "bag", "ros1": "bag.bag"}


class Here:
    def __init__(self, program, source, python, scratch):
        self.program, self.source, self.python, self.scratch = program, source, python, scratch
        self.environment = dict(os.environ, BODYSCHEMA_PYTHON=str(python), XDG_CACHE_HOME=str(scratch / "cache"))

    def run(self, *arguments, status=0, environment=None):
        done = subprocess.run([self.program, *map(str, arguments)], env=environment or self.environment, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True, check=False)
        said = done.stdout + done.stderr
        assert done.returncode == status, f"{arguments}: status {done.returncode}, expected {status}\n{said}"
        return said

    def bag(self, name, stills, kind, *keys):
        folder = self.scratch / name
        folder.mkdir()
        path = folder / KINDS[kind]
        subprocess.run([self.python, pathlib.Path(__file__).with_name("bag_of_stills.py"), stills, path, kind, *keys],
                       check=True)
        return path


def write_stills(folder):
    """Two postures of the seven-joint arm, 8x6 px."""
    folder.mkdir()
    joints = [f"joint{j}" for j in range(1, 8)]
    rows = ["posture," + ",".join(joints)]
    for posture in range(2):
        rows.append(",".join([str(posture), *(f"{0.1 * j + 0.2 * posture:.3f}" for j in range(7))]))
        for camera in ("left", "right"):
            place = folder / "images" / camera
            place.mkdir(parents=True, exist_ok=True)
            pixels = bytes((7 * i + 31 * posture) % 256 for i in range(8 * 6 * 3))
            (place / f"{posture:02d}.ppm").write_bytes(b"P6\n8 6\n255\n" + pixels)
            masks = folder / "masks" / camera
            masks.mkdir(parents=True, exist_ok=True)
            (masks / f"{posture:02d}.pgm").write_bytes(b"P5\n8 6\n255\n" + bytes(255 * (i % 2) for i in range(48)))
    (folder / "joints.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def write_robot(here):
    file = here.scratch / "robot.yaml"
    lens = "width: 8, height: 6, fx: 8, fy: 8, cx: 3.5, cy: 2.5"
    file.write_text(f"robot:\n  urdf: {here.source}/meshes/arm7/arm7.urdf\n  rendered_links: [link2, hand]\n"
                    "  hand_link: hand\n  estimated_joints: [joint1]\n"
                    f"cameras:\n  left: {{link: base, pose: unknown, {lens}}}\n"
                    f"  right: {{link: base, pose: unknown, {lens}}}\n", encoding="utf-8")
    return file


def check_formats(here, stills, robot):
    """Every format and encoding gives, byte for byte, the log of the folder."""
    log = here.scratch / "folder.lcmlog"
    here.run("import", "stills", stills, "--config", robot, "--out", log, "--no-masks")
    cases = [("mcap",), ("mcap", "encoding=bgr8", "compression=zstd"), ("sqlite3", "encoding=rgba8"),
             ("sqlite3", "compression=zstd"), ("ros1",), ("ros1", "encoding=bgr8")]
    for i, (kind, *keys) in enumerate(cases):
        bag = here.bag(f"format{i}", stills, kind, *keys)
        out = here.scratch / f"format{i}.lcmlog"
        said = here.run("import", "ros-bag", bag, "--config", robot, "--out", out)
        assert out.read_bytes() == log.read_bytes(), f"{kind} {keys}: another log than the folder's\n{said}"
    # A recorder that was killed leaves no metadata.yaml; the file itself is whole.
    bag = here.scratch / "format0" / "bag"
    (bag / "metadata.yaml").unlink()
    out = here.scratch / "no_metadata.lcmlog"
    here.run("import", "ros-bag", bag, "--config", robot, "--out", out)
    assert out.read_bytes() == log.read_bytes()


def check_choices(here, stills, robot):
    bag = here.bag("choices", stills, "mcap", "second_joints=1", "masks=1", "wide_info=1")
    out = here.scratch / "choices.lcmlog"
    said = here.run("import", "ros-bag", bag, "--config", robot, "--out", out, status=2)
    assert "--joints TOPIC" in said and "/joint_commands" in said, said
    assert not out.exists()
    said = here.run("import", "ros-bag", bag, "--config", robot, "--out", out, "--joints", "/joint_states",
                    "--masks-left", "/left/mask", "--masks", "right=/right/mask")
    assert "2 pictures of camera left and 2 masks" in said, said
    assert "/rig/left/camera_info has 16, 16" in said, said
    assert "tf has camera 'left' (left_optical) on link 'base' at xyz 0.1000 0.2000 0.3000" in said, said
    assert "on link 'hand'" in said and "it moves there" in said, said
    said = here.run("import", "ros-bag", bag, "--camera-info", here.scratch / "infos")
    assert "/joint_states  sensor_msgs/msg/JointState, 42 messages, joint1" in said, said
    assert (here.scratch / "infos" / "rig_left.yaml").exists(), said


def check_bad(here, stills, robot):
    out = here.scratch / "bad.lcmlog"

    def refused(bag, *words):
        said = here.run("import", "ros-bag", bag, "--config", robot, "--out", out, status=2)
        assert all(word in said for word in (str(bag), *words)), said
        assert said.count("error:") == 1 and "Traceback" not in said and not out.exists(), said

    for kind in KINDS:
        bag = here.bag("cut_" + kind, stills, kind)
        files = sorted(f for f in bag.iterdir() if f.suffix != ".yaml") if bag.is_dir() else [bag]
        data = files[0].read_bytes()
        for share in (0.6, 0.01, 0.0):
            files[0].write_bytes(data[:int(share * len(data))])
            refused(bag)
    refused(here.scratch / "nowhere", "no such bag")
    (here.scratch / "text.bag").write_text("this is no bag\n", encoding="utf-8")
    refused(here.scratch / "text.bag")
    bag = here.bag("broken_picture", stills, "mcap", "broken_picture=1", "no_stamps=1")
    said = here.run("import", "ros-bag", bag, "--config", robot, "--out", out)
    assert "left out, pictures of camera left: 1; /rig/left/image_rect at 30.0" in said, said
    assert "have no stamp" in said, said
    nothing = dict(here.environment, BODYSCHEMA_PYTHON="/nowhere/python")
    said = here.run("import", "ros-bag", bag, "--list", status=1, environment=nothing)
    assert "/nowhere/python: cannot be started" in said, said


def check_environment(here, stills, robot):
    """Without an interpreter that is named, the command makes one, once, and says so."""
    bag = here.bag("environment", stills, "mcap")
    environment = dict(here.environment)
    del environment["BODYSCHEMA_PYTHON"]
    said = here.run("import", "ros-bag", bag, "--list", environment=environment)
    assert "Python packages for this import are set up once" in said, said
    said = here.run("import", "ros-bag", bag, "--config", robot, "--out", here.scratch / "environment.lcmlog",
                    environment=environment)
    assert "set up" not in said, said
    # An environment that was not finished is made anew.
    complete = here.scratch / "cache/bodyschema/python/ros-bag/complete"
    complete.write_text("", encoding="utf-8")
    unreachable = dict(environment, PIP_INDEX_URL="http://127.0.0.1:9/", PIP_RETRIES="0", PIP_NO_CACHE_DIR="1")
    said = here.run("import", "ros-bag", bag, "--list", status=1, environment=unreachable)
    assert "connect this machine to PyPI once" in said and "BODYSCHEMA_PYTHON" in said, said


def check_real(here):
    data = pathlib.Path(os.environ.get("BODYSCHEMA_DATA", here.source.parent / "shared/data")) / "real"
    if not (data / "lbr_zed5").is_dir():
        print(f"{data}/lbr_zed5 is absent, skipped")
        return SKIPPED
    robot = here.scratch / "lbr"
    here.run("new-robot", data / "robots/lbr_med7/lbr_med7.urdf", "--stills", data / "lbr_zed5", "--camera-pose",
             f"{data}/lbr_zed5/camera_pose.json:left_dr", "--out", robot)
    logs = {"folder": here.scratch / "folder.lcmlog", "bag": here.scratch / "bag.lcmlog"}
    here.run("import", "stills", data / "lbr_zed5", "--config", robot / "estimator.yaml", "--out", logs["folder"])
    bag = here.bag("real", data / "lbr_zed5", "mcap", "masks=1", "encoding=bgr8")
    here.run("import", "ros-bag", bag, "--config", robot / "estimator.yaml", "--out", logs["bag"],
             "--masks-left", "/left/mask", "--masks-right", "/right/mask")
    lines = {}
    for name, log in logs.items():
        here.run("replay", log, "--config", robot / "estimator.yaml", "--out", here.scratch / ("out_" + name))
        lines[name] = (here.scratch / ("out_" + name) / "estimates.jsonl").read_bytes()
    assert lines["folder"].count(b"\n") >= 5, "a line for each posture"
    assert lines["folder"] == lines["bag"], "the bag gives other estimates than the folder"
    return 0


def main():
    program, source, venv, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    python = python_with(venv, "rosbags", "numpy", "PIL")
    if python is None:
        return SKIPPED
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    here = Here(program, source, python, scratch)
    if sys.argv[5:] == ["real"]:
        return check_real(here)
    stills = scratch / "stills"
    write_stills(stills)
    robot = write_robot(here)
    check_formats(here, stills, robot)
    check_choices(here, stills, robot)
    check_bad(here, stills, robot)
    check_environment(here, stills, robot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
