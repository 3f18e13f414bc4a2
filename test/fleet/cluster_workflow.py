"""Runs workflow/Snakefile by Snakemake's way to a cluster. No cluster is here: a stand-in takes its place, which runs
each script that is submitted later, in another folder and with nothing of this environment. Exit 77 means skipped.

usage: cluster_workflow.py BIN_DIR SOURCE_DIR SCRATCH_DIR VENV_DIR
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys

from workflow import PATIENCE, write_photographs

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "install"))
from python_packages import SKIPPED, python_with  # noqa: E402  # pylint: disable=wrong-import-position

ROBOTS = ("studio", "second floor")
# What a cluster's command does: it takes options and a script, prints a number, and is gone before the script begins.
SUBMIT = """#!/bin/bash
echo "$@" >>{scratch}/submitted.txt
cd / && env -i HOME={scratch} PATH=/usr/bin:/bin setsid bash "${{@: -1}}" >>{scratch}/jobs.txt 2>&1 </dev/null &
echo $$
"""


def ways(venv):
    """How the Snakemakes of this machine reach a cluster: name, program, options before the command that submits."""
    found = []
    if debian := shutil.which("snakemake"):
        version = subprocess.run([debian, "--version"], check=True, capture_output=True, text=True).stdout
        if int(version.split(".")[0]) < 8:
            found.append(("cluster", [debian], ["--cluster"]))
    if python := python_with(venv, "snakemake", "snakemake_executor_plugin_cluster_generic"):
        found.append(("plugin", [python, "-m", "snakemake"],
                      ["--seconds-between-status-checks", "1", "--executor", "cluster-generic",
                       "--cluster-generic-submit-cmd"]))
    return found


def check(snakemake, options, programs, source, scratch):
    shutil.rmtree(scratch, ignore_errors=True)
    for robot in ROBOTS:
        write_photographs(source, scratch / "logs" / robot)
    submit = scratch / "submit"
    submit.write_text(SUBMIT.format(scratch=scratch), encoding="utf-8")
    submit.chmod(0o755)
    # CI: old ones look every second whether a job is done, not every ten.
    environment = dict(os.environ, HOME=str(scratch), XDG_CACHE_HOME=str(scratch / "cache"), CI="true")
    done = subprocess.run([*snakemake, "-s", source / "workflow/Snakefile", *options,
                           f"{submit} -c {{threads}} --mem={{resources.mem_mb}}", "--jobs", "3", "--config",
                           "logs=logs", "out=fleet", f"program={programs}/bodyschema", "memory_mb=700"],
                          cwd=scratch, env=environment,
                          text=True, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          timeout=250 * PATIENCE)
    assert done.returncode == 0, done.stdout + (scratch / "jobs.txt").read_text(encoding="utf-8")
    submitted = (scratch / "submitted.txt").read_text(encoding="utf-8").splitlines()
    assert len(submitted) == 3 * len(ROBOTS) + 1, submitted  # import, info and diagnosis of each, the report
    assert sum(line.startswith("-c 2 --mem=700 ") for line in submitted) == len(ROBOTS), submitted
    fleet = json.loads((scratch / "fleet" / "fleet.json").read_text(encoding="utf-8"))["robots"]
    assert {robot["robot"] for robot in fleet} == set(ROBOTS), fleet
    for robot in fleet:
        assert "too short for a diagnosis" in robot["logs"][0]["sentence"], robot


def main():
    programs, source, scratch, venv = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    found = ways(venv)
    for name, snakemake, options in found:
        check(snakemake, options, programs, source, scratch / name)
        print(f"by {name}: passed")
    return 0 if found else SKIPPED


if __name__ == "__main__":
    sys.exit(main())
