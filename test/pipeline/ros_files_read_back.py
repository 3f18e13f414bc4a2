"""What `bodyschema export` writes for ROS, read by those who read it there; exit 77 means skipped.

usage: ros_files_read_back.py PROGRAM SOURCE_DIR VENV_DIR SCRATCH_DIR
Joints: PyPI's xacro, the official one, makes a URDF of them. Cameras: ROS's camera_calibration_parsers, where Debian's
python3-camera-calibration-parsers is installed. Transforms: static_transform_publisher needs a running ROS, so a
stand-in for `ros2` takes the command line by its documented options. ros2_control: no parser is to be had without ROS,
so the elements are held against the documented format.
"""
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "install"))
from python_packages import SKIPPED, python_with  # noqa: E402  # pylint: disable=wrong-import-position

OFFSETS_DEG = {"joint1": 1.5, "joint2": -2.0, "joint6": 0.25}
STAND_IN = """#!/bin/sh
# Stands in for ROS 2's `ros2`: writes down what it was called with.
for word in "$@"; do printf '%s\\n' "$word"; done >"$RECORD.$$"
"""
READ_INFO = """
import sys, camera_calibration_parsers
name, info = camera_calibration_parsers.readCalibration(sys.argv[1])
print(name, info.width, info.height, info.distortion_model, *info.K, *info.D, *info.R, *info.P)
"""


def export(program, source, scratch):
    lens = "width: 320, height: 240, fx: 420, fy: 421, cx: 159.5, cy: 119.25, distortion: [0.01, -0.02, 0, 0, 0]"
    (scratch / "robot.yaml").write_text(
        f"robot:\n  urdf: {source}/meshes/arm7/arm7.urdf\n  rendered_links: [link2, hand]\n  hand_link: hand\n"
        "  estimated_joints: [joint1, joint2, joint3, joint4, joint5, joint6, joint7]\n"
        "cameras:\n"
        "  left: {link: base, X_link_optical: {xyz_m: [1, 0.2, 0.3], rpy_rad: [0.1, 0.2, 0.3]}, pose: roughly,\n"
        f"         pose_sd_deg: 5, pose_sd_mm: 50, {lens}}}\n"
        f"  right: {{link: camera_right_optical, {lens}}}\n", encoding="utf-8")
    stddev = {joint: 0.05 for joint in OFFSETS_DEG}
    effects = [{"name": "focal_length", "parameter": "scale", "unit": "%", "value": 1.0, "stddev": 0.1}]
    (scratch / "summary.json").write_text(json.dumps({"estimate": {
        "state": "converged", "offset_deg": OFFSETS_DEG, "stddev_deg": stddev, "told": list(OFFSETS_DEG),
        "effects": effects}}), encoding="utf-8")
    subprocess.run([program, "export", scratch / "summary.json", "--config", scratch / "robot.yaml", "--out",
                    scratch / "out"], check=True)
    return scratch / "out"


def origins(urdf):
    found = {}
    for joint in ET.parse(urdf).getroot().findall("joint"):
        origin = joint.find("origin")
        found[joint.get("name")] = [
            [float(x) for x in (origin.get(key, "0 0 0") if origin is not None else "0 0 0").split()]
            for key in ("xyz", "rpy")]
    return found


def check_joints(out, source, python, scratch):
    """The robot's own URDF with the calibrated origins taken from the file."""
    tree = ET.parse(source / "meshes/arm7/arm7.urdf")
    robot = tree.getroot()
    lines = [f'<robot name="arm7" xmlns:xacro="http://www.ros.org/wiki/xacro">',
             f'<xacro:property name="calibration" value="${{xacro.load_yaml(\'{out}/ros/joint_calibration.yaml\')}}"/>']
    for element in robot:
        if element.tag == "joint" and element.get("name") in OFFSETS_DEG:
            name = element.get("name")
            lines.append(f'<xacro:property name="c" value="${{calibration[\'joints\'][\'{name}\']}}"/>')
            origin = element.find("origin")
            if origin is None:
                origin = ET.SubElement(element, "origin")
            origin.set("xyz", "${c['x']} ${c['y']} ${c['z']}")
            origin.set("rpy", "${c['roll']} ${c['pitch']} ${c['yaw']}")
        lines.append(ET.tostring(element, encoding="unicode"))
    (scratch / "arm.urdf.xacro").write_text("\n".join([*lines, "</robot>"]), encoding="utf-8")
    done = subprocess.run([python.parent / "xacro", scratch / "arm.urdf.xacro", "-o", scratch / "arm.urdf"], text=True,
                          capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    made, corrected = origins(scratch / "arm.urdf"), origins(out / "corrected.urdf")
    assert made.keys() == corrected.keys()
    for joint, origin in corrected.items():
        for a, b in zip(sum(origin, []), sum(made[joint], [])):
            assert math.isclose(a, b, abs_tol=1e-9), f"{joint}: {origin} in corrected.urdf, {made[joint]} by xacro"
    nominal = origins(source / "meshes/arm7/arm7.urdf")
    assert all(nominal[joint] != corrected[joint] for joint in OFFSETS_DEG), "the offsets are in no origin"


def check_cameras(out):
    """Whether ROS's own parser is there."""
    python = "/usr/bin/python3"
    if subprocess.run([python, "-c", "import camera_calibration_parsers"], capture_output=True,
                      check=False).returncode != 0:
        print("camera_calibration_parsers is not installed (Debian: python3-camera-calibration-parsers), not read with it")
        return False
    for camera in ("left", "right"):
        done = subprocess.run([python, "-c", READ_INFO, out / "ros/camera_info" / f"{camera}.yaml"], text=True,
                              capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
        name, width, height, model, *numbers = done.stdout.split()
        assert (name, width, height, model) == (camera, "320", "240", "plumb_bob"), done.stdout
        fx, fy = 420 * 1.01, 421 * 1.01
        expected = [fx, 0, 159.5, 0, fy, 119.25, 0, 0, 1, 0.01, -0.02, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1,
                    fx, 0, 159.5, 0, 0, fy, 119.25, 0, 0, 0, 1, 0]
        assert len(numbers) == len(expected), numbers
        assert all(math.isclose(float(a), b, abs_tol=1e-5) for a, b in zip(numbers, expected)), numbers
    return True


def check_transforms(out, scratch):
    (scratch / "bin").mkdir()
    (scratch / "bin/ros2").write_text(STAND_IN, encoding="utf-8")
    (scratch / "bin/ros2").chmod(0o755)
    environment = dict(os.environ, PATH=f"{scratch}/bin:{os.environ['PATH']}", RECORD=str(scratch / "called"))
    subprocess.run(["sh", out / "ros/static_transforms.sh"], env=environment, check=True)
    calls = [file.read_text(encoding="utf-8").split("\n")[:-1] for file in scratch.glob("called.*")]
    assert len(calls) == 1, "one camera is no link of the URDF"
    assert calls[0][:3] == ["run", "tf2_ros", "static_transform_publisher"], calls
    options = dict(zip(calls[0][3::2], calls[0][4::2]))
    assert set(options) == {"--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw", "--frame-id", "--child-frame-id"}
    assert (options["--frame-id"], options["--child-frame-id"]) == ("base", "left_optical_frame")
    assert [float(options[key]) for key in ("--x", "--y", "--z")] == [1.0, 0.2, 0.3]
    # Rz(0.3) Ry(0.2) Rx(0.1), as the configuration has it.
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2), math.cos(a / 2)) for a in (0.1, 0.2, 0.3))
    expected = {"x": sr * cp * cy - cr * sp * sy, "y": cr * sp * cy + sr * cp * sy,
                "z": cr * cp * sy - sr * sp * cy, "w": cr * cp * cy + sr * sp * sy}
    for axis, value in expected.items():
        assert math.isclose(float(options["--q" + axis]), value, abs_tol=1e-9), (axis, value, options)


def check_transmissions(out):
    """x_joint = x_actuator / n + x_off (SimpleTransmission); encoder = true + offset."""
    root = ET.parse(out / "ros/ros2_control_transmissions.xml").getroot()
    offsets = {}
    for transmission in root.findall("transmission"):
        assert transmission.get("name")
        assert transmission.find("plugin").text == "transmission_interface/SimpleTransmission"
        assert transmission.find("actuator").get("role") == "actuator1"
        joint = transmission.find("joint")
        assert joint.get("role") == "joint1" and float(joint.find("mechanical_reduction").text) == 1.0
        offsets[joint.get("name")] = float(joint.find("offset").text)
    assert offsets.keys() == OFFSETS_DEG.keys()
    for joint, offset in OFFSETS_DEG.items():
        true = 0.3
        encoder = true + math.radians(offset)
        assert math.isclose(encoder / 1.0 + offsets[joint], true, abs_tol=1e-8), joint


def main():
    program, source, venv, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    out = export(program, source, scratch)
    check_transforms(out, scratch)
    check_transmissions(out)
    cameras = check_cameras(out)
    python = python_with(venv, "xacro")
    if python is not None:
        check_joints(out, source, python, scratch)
    return 0 if cameras and python is not None else SKIPPED


if __name__ == "__main__":
    sys.exit(main())
