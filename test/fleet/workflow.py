"""Runs workflow/Snakefile on a small fleet: one log that can be diagnosed, one that is too short, one
that comes later, and a folder of photographs. Exit 77 means skipped.

usage: workflow.py BIN_DIR SOURCE_DIR SCRATCH_DIR
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys

SKIPPED = 77
PATIENCE = float(os.environ.get("BODYSCHEMA_TEST_PATIENCE", "1"))  # sanitizers are slow


def write_photographs(source, robot):
    """Two postures of the seven-joint arm, 8x6 px, in degrees: too few for a diagnosis, and it is to say so."""
    folder = robot / "photographs"
    (folder / "images" / "top").mkdir(parents=True)
    (folder / "joints.csv").write_text("axis1,axis2,axis3,axis4,axis5,axis6,axis7,posture\n0,10,0,40,0,90,0,0\n"
                                       "0,20,0,50,0,80,0,1\n", encoding="utf-8")
    for posture in range(2):
        (folder / "images" / "top" / f"{posture:02d}.ppm").write_bytes(
            b"P6\n8 6\n255\n" + bytes((7 * i + 31 * posture) % 256 for i in range(8 * 6 * 3)))
    (robot / "estimator.yaml").write_text(
        "include: [config/estimator.yaml, config/bus.yaml, config/vision.yaml]\n"
        f"robot:\n  urdf: {source}/meshes/arm7/arm7.urdf\n  rendered_links: [link2, hand]\n  hand_link: hand\n"
        "  estimated_joints: [joint1, joint2]\nvision: {method: statistics}\n"
        "cameras:\n  top: {link: camera_left_optical, width: 8, height: 6, fx: 8, fy: 8, cx: 3.5, cy: 2.5}\n",
        encoding="utf-8")
    (robot / "mapping.yaml").write_text(
        "import:\n  unit: deg\n  joints: {" + ", ".join(f"axis{j}: joint{j}" for j in range(1, 8)) + "}\n",
        encoding="utf-8")


def main():
    programs, source, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    if shutil.which("snakemake") is None:
        print("snakemake is not installed (scripts/setup --tests brings it), skipped")
        return SKIPPED
    shutil.rmtree(scratch, ignore_errors=True)
    logs, out = scratch / "logs", scratch / "fleet"
    for robot in ("left_lab", "right_lab", "studio"):
        (logs / robot).mkdir(parents=True)
    write_photographs(source, logs / "studio")
    environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}", HOME=str(scratch),
                       XDG_CACHE_HOME=str(scratch / "cache"))

    def simulate(file, *motion):
        subprocess.run(["bodyschema-sim", "--config", "config/icub_right/simulator.yaml", *motion, "--log", file],
                       check=True, env=environment, stderr=subprocess.DEVNULL, timeout=120 * PATIENCE)

    def workflow(*more):
        done = subprocess.run(["snakemake", "-s", source / "workflow/Snakefile", "--cores", "2", "--config",
                               f"logs={logs}", f"out={out}", *more], cwd=scratch, env=environment, text=True,
                              check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=400 * PATIENCE)
        print(done.stdout)
        return done

    simulate(logs / "left_lab" / "monday.lcmlog", "--babble", "14", "--set", "simulator.cameras.rate_hz=5")
    short_log = logs / "right_lab" / "short.lcmlog"
    simulate(short_log, "--reach", "--frames", "30")
    os.truncate(short_log, 3_000_000)  # a few pictures, before the arm comes into view

    # A wrong configuration is not a result: it fails, and the next run goes on from there.
    wrong = workflow("config=/nonexistent.yaml")
    assert wrong.returncode != 0 and "/nonexistent.yaml" in wrong.stdout
    assert not (out / "report.html").exists()

    done = workflow()
    assert done.returncode == 0
    fleet = {r["robot"]: r for r in json.loads((out / "fleet.json").read_text())["robots"]}
    assert set(fleet) == {"left_lab", "right_lab", "studio"}
    photographs, = fleet["studio"]["logs"]
    assert photographs["log"] == "photographs" and photographs["verdict"] == "not diagnosed", photographs
    assert "too short for a diagnosis" in photographs["sentence"], photographs
    monday, = fleet["left_lab"]["logs"]
    assert monday["verdict"] in ("none", "named", "class", "unexplained"), monday
    assert monday["begin_utime"] > 1_500_000_000_000_000
    short, = fleet["right_lab"]["logs"]
    assert short["verdict"] == "not diagnosed" and " s" in short["sentence"], short
    page = (out / "report.html").read_text()
    assert "left_lab" in page and "monday" in page and "not diagnosed" in page

    # Nothing is done twice; a new log alone is.
    assert "Nothing to be done" in workflow().stdout
    shutil.copy(logs / "right_lab" / "short.lcmlog", logs / "left_lab" / "tuesday.lcmlog")
    again = workflow()
    assert again.returncode == 0
    assert again.stdout.count("rule diagnose:") == 1, "only the new log is diagnosed"
    assert len(json.loads((out / "fleet.json").read_text())["robots"][0]["logs"]) == 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
