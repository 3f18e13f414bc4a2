#!/usr/bin/env python3
"""Runs the commands of one page of docs/ as its reader would: every block fenced as `sh`, in order, in
an empty folder. A command that fails fails the page. A `text` block that follows an `sh` block is what
the page says is printed: every line of it must appear in the output, where `...` stands for anything.

usage: run_page.py PAGE BIN_DIR SOURCE_DIR SCRATCH_DIR
/usr/share/bodyschema (configurations, robots) and /usr/share/doc/bodyschema stand for the source tree,
/etc/bodyschema for the folder of the robot that the package's file there names. A page that uses
BODYSCHEMA_DATA is skipped where that folder is absent. test/docs/PAGE.py, where there is one, makes what
the page's reader has already, and says by 77 that it cannot. Exit 77 means skipped.
"""
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys

SKIPPED = 77
PATIENCE = float(os.environ.get("BODYSCHEMA_TEST_PATIENCE", "1"))  # sanitizers are slow
BLOCK = re.compile(r"^```(sh|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def matches(expected, output):
    pattern = r"[^\n]*".join(re.escape(part) for part in re.split(r"\.\.\.", expected.strip()))
    return re.search(re.sub(r"(\\ )+", r"[ \\t]+", pattern), output) is not None


def lcm_works():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("239.255.76.67", 7667))
        except OSError:
            return False
    return True


def main():
    page, programs, source, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    # A network of its own, so that tests beside it are not disturbed.
    environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}",
                       LCM_DEFAULT_URL=f"udpm://239.255.76.67:{40000 + os.getpid() % 20000}?ttl=0")
    environment.pop("BODYSCHEMA_SHARE", None)
    environment.setdefault("BODYSCHEMA_DATA", str(source.parent / "shared/data"))
    text = page.read_text(encoding="utf-8")
    if "$BODYSCHEMA_DATA" in text and not pathlib.Path(environment["BODYSCHEMA_DATA"]).is_dir():
        print(f"{page.name}: {environment['BODYSCHEMA_DATA']} is absent, skipped")
        return SKIPPED
    # Packages of PyPI that a command sets up are kept for all pages of this build.
    environment["XDG_CACHE_HOME"] = str(scratch.parent.parent / "cache")
    before = pathlib.Path(__file__).with_name(page.stem + ".py")
    if before.exists():
        made = subprocess.run([sys.executable, before, source, scratch], env=environment, check=False)
        if made.returncode != 0:
            return made.returncode
    output, runs = "", 0
    for kind, content in BLOCK.findall(text):
        content = content.replace("/usr/share/doc/bodyschema", str(source))
        content = content.replace("/usr/share/bodyschema", str(source))
        content = content.replace("/etc/bodyschema", str(source / "config/icub_right"))
        if kind == "sh":
            runs += 1
            print(content, flush=True)
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", content], cwd=scratch, text=True,
                                  env=environment, stdin=subprocess.DEVNULL, check=False,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=850 * PATIENCE)
            output = done.stdout
            print(output, flush=True)
            if done.returncode != 0 and not lcm_works():
                print(f"{page.name}: no multicast route, which LCM needs (scripts/multicast makes one), skipped")
                return SKIPPED
            if done.returncode != 0:
                print(f"{page.name}: status {done.returncode} of\n{content}")
                return 1
        else:
            missing = [line for line in content.splitlines() if line.strip() and not matches(line, output)]
            if missing:
                print(f"{page.name} promises what was not printed:\n" + "\n".join(missing))
                return 1
    if runs == 0:
        print(f"{page.name}: no command to run")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
