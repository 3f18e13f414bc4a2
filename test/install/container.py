"""Builds the Dockerfile and runs the programs in the container. Exit 77 means skipped: neither Docker nor
Podman works here, or the base image cannot be had.

usage: container.py SOURCE_DIR
"""
import shutil
import subprocess
import sys

SKIPPED = 77
IMAGE = "bodyschema-test"


def run(*command, **more):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **more)


def main():
    source = sys.argv[1]
    for engine in ("docker", "podman"):
        if shutil.which(engine) is None:
            print(f"{engine} is not installed")
            continue
        answer = run(engine, "info")
        if answer.returncode == 0:
            break
        print(f"{engine} does not work here: {answer.stdout.strip().splitlines()[-1]}")
    else:
        return SKIPPED
    base, = {line.split()[1] for line in open(f"{source}/Dockerfile") if line.startswith("FROM ")}
    pulled = run(engine, "pull", base)
    if pulled.returncode != 0:
        print(f"no {base} to be had: {pulled.stdout}")
        return SKIPPED
    built = run(engine, "build", "-t", IMAGE, source)
    print(built.stdout[-4000:])
    assert built.returncode == 0
    for program in ("bodyschema", "bodyschema-sim", "bodyschemad"):
        answer = run(engine, "run", "--rm", IMAGE, program, "--version")
        assert answer.returncode == 0 and answer.stdout.strip(), answer.stdout
    reach = run(engine, "run", "--rm", IMAGE, "bodyschema-sim", "--config", "config/icub_right/simulator.yaml",
                "--reach", "--frames", "5", "--log", "/tmp/reach.lcmlog")
    assert reach.returncode == 0, reach.stdout
    return 0


if __name__ == "__main__":
    sys.exit(main())
