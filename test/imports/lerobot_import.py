"""LeRobot data sets, imported by the program; exit 77 means skipped.

BODYSCHEMA_LCM_TYPES names the folder of the Python message types.

usage: lerobot_import.py PROGRAM SOURCE_DIR VENV_DIR SCRATCH_DIR [real]
The sets are written here by the published layout of v2.1 and v3.0 (pyarrow and av write parquet and video; no official
LeRobot writer takes part). With `real`: the episodes of $BODYSCHEMA_DATA/real/g1.
"""
import csv
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "install"))
from python_packages import SKIPPED, python_with  # noqa: E402  # pylint: disable=wrong-import-position


class Here:
    def __init__(self, program, source, python, scratch):
        self.program, self.source, self.python, self.scratch = program, source, python, scratch
        data = os.environ.get("BODYSCHEMA_DATA", str(source.parent / "shared/data"))
        self.environment = dict(os.environ, BODYSCHEMA_PYTHON=str(python), BODYSCHEMA_DATA=data)

    def run(self, *arguments, status=0):
        done = subprocess.run([self.program, *map(str, arguments)], env=self.environment, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True, check=False)
        said = done.stdout + done.stderr
        assert done.returncode == status, f"{arguments}: status {done.returncode}, expected {status}\n{said}"
        assert "Traceback" not in said, said
        return said

    def read_log(self, log):
        """Stamp and angles of each row; stamp of each picture, and how wide the bar in it is."""
        types = os.environ["BODYSCHEMA_LCM_TYPES"]
        done = subprocess.run([self.python, "-c", READ_LOG, types, log], text=True, capture_output=True, check=True)
        return json.loads(done.stdout)

    def set(self, name, *keys):
        folder = self.scratch / name
        subprocess.run([self.python, pathlib.Path(__file__).with_name("lerobot_set.py"), folder, *keys], check=True,
                       env=dict(self.environment, SVT_LOG="1"))
        return folder


READ_LOG = """
import json, pathlib, struct, sys
sys.path.insert(0, sys.argv[1])
from bot_core import joint_state_t, images_t
data = pathlib.Path(sys.argv[2]).read_bytes()
at, rows, pictures = 0, [], []
while at < len(data):
    _, _, stamp, channel_size, size = struct.unpack_from(">IqqII", data, at)
    channel = data[at + 28:at + 28 + channel_size].decode()
    body = data[at + 28 + channel_size:at + 28 + channel_size + size]
    at += 28 + channel_size + size
    if channel.endswith("JOINT_STATE"):
        m = joint_state_t.decode(body)
        rows.append([m.utime, dict(zip(m.joint_name, m.joint_position))])
    else:
        m = images_t.decode(body)
        image = m.images[0]
        bar = sum(image.data[3 * u] > 150 for u in range(image.width)) if image.row_stride == 3 * image.width else 0
        pictures.append([m.utime, bar])
json.dump([rows, pictures], sys.stdout)
"""


def write_robot(here):
    """Columns in degrees, one camera of another name, another order of names, a gripper that is not in the URDF."""
    (here.scratch / "robot.yaml").write_text(
        f"robot:\n  urdf: {here.source}/meshes/arm7/arm7.urdf\n  rendered_links: [link2, hand]\n"
        "  hand_link: hand\n  estimated_joints: [joint1]\n"
        "cameras:\n  top: {link: base, pose: unknown, width: 64, height: 48, fx: 64, fy: 64, cx: 31.5, cy: 23.5}\n",
        encoding="utf-8")
    (here.scratch / "mapping.yaml").write_text(
        "import:\n  unit: deg\n  joints:\n"
        + "".join(f"    axis{j}: joint{j}\n" for j in range(1, 8))
        + "    gripper: '-'\n"
        + "  cameras: {top: observation.images.side}\n", encoding="utf-8")
    return here.scratch / "robot.yaml", here.scratch / "mapping.yaml"


def check_versions(here, robot, mapping):
    """One content in both layouts: the same logs."""
    old, new = here.set("v21", "version=2.1"), here.set("v30", "version=3.0")
    said = here.run("import", "lerobot", new, "--list")
    assert "LeRobot v3.0, 4 episodes, 3 of them here" in said and "axis7" in said, said
    for name, folder in (("v21", old), ("v30", new)):
        said = here.run("import", "lerobot", folder, "--config", robot, "--mapping", mapping, "--raw",
                        "--out", here.scratch / ("logs_" + name))
        assert "3 logs written; 1 episode left out, episode 2: no data/" in said or \
               "3 logs written; 1 episode left out, episode 2: not in meta/episodes" in said, said
        assert "20 joint messages of 7 joints, 20 pictures of camera top" in said, said
    for number in (0, 1, 3):
        logs = [here.scratch / f"logs_{name}" / f"episode_{number:06d}.lcmlog" for name in ("v21", "v30")]
        (rows, pictures), other = here.read_log(logs[0]), here.read_log(logs[1])
        assert [rows, pictures] == other, f"episode {number}: other logs"
        begin = rows[0][0]
        for k, ((utime, q), (picture, bar)) in enumerate(zip(rows, pictures)):
            assert utime - begin == round(1e6 * k / 30) and abs(picture - utime) <= 1
            assert bar == 2 + 2 * k, f"episode {number}: row {k} has the picture of row {bar / 2 - 1}"
            assert abs(math.degrees(q["joint7"]) - (70 + 5 * number + 0.5 * k)) < 1e-4
    said = here.run("import", "lerobot", new, "--config", robot, "--mapping", mapping, "--episodes", "1,3",
                    "--out", here.scratch / "two.lcmlog")
    assert "40 joint messages of 7 joints, 40 pictures of camera top" in said and "1 log written" in said, said
    images = here.set("images", "version=2.1", "images=1")
    said = here.run("import", "lerobot", images, "--config", robot, "--mapping", mapping, "--episodes", "0",
                    "--out", here.scratch / "images_logs")
    assert "20 pictures of camera top" in said, said


def check_bad(here, robot, mapping):
    out = here.scratch / "bad"

    def imported(folder, *more, status=0):
        return here.run("import", "lerobot", folder, "--config", robot, "--mapping", mapping, "--out", out, *more,
                        status=status)

    short = here.set("short", "version=2.1", "short_video=7")
    said = imported(short, "--episodes", "0")
    assert "left out, pictures that rows should have, camera top: 13" in said, said
    assert "20 rows and 7 pictures" in said, said
    cut = here.set("cut", "version=2.1")
    video = cut / "videos/chunk-000/observation.images.side/episode_000001.mp4"
    video.write_bytes(video.read_bytes()[:200])
    said = imported(cut, "--episodes", "0-1")
    assert "1 log written; 1 episode left out, episode 1: " in said, said
    rows = cut / "data/chunk-000/episode_000000.parquet"
    rows.write_bytes(rows.read_bytes()[:300])
    said = imported(cut, "--episodes", "0", status=2)
    assert "error: episode 0: " in said, said
    said = imported(here.set("nan", "version=2.1", "nan=1"), "--episodes", "0")
    assert "20 joint messages of 7 joints" in said and "left out, readings: 1; 'axis" in said, said
    wide = here.set("wide", "version=2.1", "width=80")
    said = imported(wide, "--episodes", "0", status=2)
    assert "no picture of any camera" in said and "80x48" in said, said
    said = imported(wide, "--episodes", "9", status=2)
    assert "expected 'all' or numbers" in said, said
    for content, words in (("{", "no JSON"), ('{"codebase_version": "v9"}', "expected v2.0")):
        (wide / "meta/info.json").write_text(content, encoding="utf-8")
        said = imported(wide, status=2)
        assert str(wide) in said and (words == "no JSON" or words in said), said
    assert "no meta/info.json" in imported(here.scratch, status=2)
    mapping.write_text(mapping.read_text(encoding="utf-8").replace("joint7", "joint8"), encoding="utf-8")
    said = imported(short, status=2)
    assert "key 'import.joints.axis7' is 'joint8', no joint of robot" in said, said


def check_real(here):
    data = pathlib.Path(here.environment["BODYSCHEMA_DATA"]) / "real/g1"
    if not data.is_dir():
        print(f"{data} is absent, skipped")
        return SKIPPED
    config = here.source / "config/g1"
    out = here.scratch / "logs"
    said = here.run("import", "lerobot", data, "--config", config / "estimator.yaml", "--mapping",
                    config / "lerobot.yaml", "--episodes", "all", "--out", out)
    assert "16 logs written; 84 episodes left out, the first: episode 0: no data/" in said, said
    assert "\nleft out, " not in said and "note:" not in said, said
    logs = sorted(out.glob("*.lcmlog"))
    assert len(logs) == 16 and logs[0].name == "episode_000004.lcmlog", logs
    with open(data / "joints/episode_000004.csv", encoding="utf-8") as file:
        expected = list(csv.DictReader(file))
    rows, pictures = here.read_log(logs[0])
    assert len(rows) == len(expected) == len(pictures) == 357
    for (utime, q), row, (picture, _) in zip(rows, expected, pictures):
        assert abs(utime - rows[0][0] - 1e6 * float(row["time_s"])) <= 1.0
        assert abs(picture - utime) <= 1, "row k belongs to frame k"
        for joint in ("left_elbow_joint", "right_wrist_yaw_joint"):
            assert abs(q[joint] - float(row[joint])) < 1e-6
        # Hands: 0 closed at 1.7 rad, 1 open at 0.
        assert abs(q["R_index_proximal_joint"] - 1.7 * (1.0 - float(row["kRightHandIndex"]))) < 1e-6
        assert abs(q["L_thumb_proximal_yaw_joint"] - (1.3 - 1.4 * float(row["kLeftHandThumbRotation"]))) < 1e-6
    return 0


def main():
    program, source, venv, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    python = python_with(venv, "pyarrow", "av", "numpy", "lcm")
    if python is None:
        return SKIPPED
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    here = Here(program, source, python, scratch)
    if sys.argv[5:] == ["real"]:
        return check_real(here)
    robot, mapping = write_robot(here)
    check_versions(here, robot, mapping)
    check_bad(here, robot, mapping)
    return 0


if __name__ == "__main__":
    sys.exit(main())
