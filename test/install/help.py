"""Every program and command explains itself with an example; completion knows every command, option
and choice; --print-config works wherever it is taken; a mistyped key is refused where a part of the
configuration is enough.

usage: help.py MANUAL_PY SCRATCH_DIR PROGRAM...
"""
import importlib.util
import pathlib
import re
import subprocess
import sys


def complete(script, words):
    """What bash offers after these words."""
    program = words[0]
    typed = " ".join(f"'{w}'" for w in words)
    ask = (f"source {script}; COMP_WORDS=({typed}); COMP_CWORD={len(words) - 1}; "
           f"_{program.replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
    return subprocess.run(["bash", "-euc", ask], check=True, text=True, timeout=30,
                          stdout=subprocess.PIPE).stdout.split()


def configuration_is_checked(page, scratch):
    """--print-config prints and stops, whatever else is asked; a missing configuration is status 2, in
    one line."""
    words = [*page.words, *["x" for _ in page.sections.get("Positionals", [])]]
    if page.words[1:] == ["evaluate"]:
        words[-1] = "paper"
    out = scratch / "not_made"
    if "--out" in page.options():
        words += ["--out", out]
    kind = "simulator" if words[0].endswith("bodyschema-sim") else "estimator"
    shown = " ".join([pathlib.Path(page.words[0]).name, *page.words[1:]])
    wrong = []
    for file, status in ((f"config/icub_right/{kind}.yaml", 0), ("/nonexistent.yaml", 2)):
        ran = subprocess.run([*words, "--config", file, "--print-config"], text=True, check=False, timeout=60,
                             capture_output=True)
        if ran.returncode != status:
            wrong.append(f"{shown} --config {file} --print-config: status {ran.returncode}, not {status}: {ran.stderr}")
        elif status == 0 and "channel_prefix: ICUB" not in ran.stdout:
            wrong.append(f"{shown} --print-config does not print it")
        elif status == 2 and (file not in ran.stderr or ran.stderr.count("\n") != 1):
            wrong.append(f"{shown}: not one line about a missing configuration: {ran.stderr}")
    return [*wrong, *[f"{shown} --print-config makes {out}" for _ in [0] if out.exists()]]


def mistyped_keys_are_refused(program, scratch):
    """Also by commands that read some sections only: status 2, and the key is named."""
    log = pathlib.Path(__file__).resolve().parents[1] / "pipeline/logs/version_0_1_0.lcmlog"
    wrong = []
    for words, keys in ((["export", "x", "--out", scratch / "not_made"], ("buss", "robot.hand_lnk")),
                        (["import-yarp", "x", "--out", scratch / "not_made"], ("yarp_imports", "buss", "bus.prefx")),
                        (["log", "info", log], ("buss", "cameras.left.fxx")),
                        (["log", "info", log, "--json"], ("buss", "robot.hand_lnk")),
                        (["log", "to-mcap", log, "--out", scratch / "not_made"], ("buss", "robot.hand_lnk"))):
        for key in keys:
            setting = key if "." in key else f"{key}.x"
            ran = subprocess.run([program, *words, "--config", "config/icub_right/estimator.yaml", "--set",
                                  f"{setting}=1"], text=True, check=False, timeout=60, capture_output=True)
            if ran.returncode != 2 or f"unknown key '{key}'" not in ran.stderr:
                wrong.append(f"{' '.join(words[:2])} --set {setting}=1: status {ran.returncode}: {ran.stderr}")
    return wrong


def main():
    specification = importlib.util.spec_from_file_location("manual", sys.argv[1])
    manual = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(manual)
    out, programs = pathlib.Path(sys.argv[2]), sys.argv[3:]
    subprocess.run([sys.executable, sys.argv[1], out, "1.2.3", *programs], check=True, timeout=120)
    wrong, pages = [], 0
    for program in programs:
        if pathlib.Path(program).name == "bodyschema":
            wrong += mistyped_keys_are_refused(program, out)
        name, todo = pathlib.Path(program).name, [[program]]
        while todo:
            page = manual.Help(todo.pop(0))
            shown = " ".join([name, *page.words[1:]])
            pages += 1
            examples = [line for title, items in page.sections.items() if title.startswith("Example")
                        for line, _ in items]
            if not any(line.strip().startswith(name) or line.strip().startswith("snakemake") for line in examples):
                wrong.append(f"{shown} --help has no example")
            if not (out / "man1" / f"{page.name}.1").exists():
                wrong.append(f"{shown} has no man page")
            def offered(*typed, words=tuple(page.words[1:])):
                return complete(out / "completions" / name, [name, *words, *typed])
            wrong += [f"completion after '{shown}' lacks {word}" for word in page.subcommands() if word not in offered("")]
            if "--help" not in offered("-"):
                wrong.append(f"completion after '{shown} -' lacks --help")
            # A value is one of its choices, or a file: nothing else may be offered, options least of all.
            for option, value in page.options().items():
                choices = value[value.index("{") + 1:value.index("}")].split(",") if "{" in value else []
                if value and offered(option, "") != choices:
                    wrong.append(f"completion after '{shown} {option}' offers {offered(option, '')}, not {choices}")
            if name == "bodyschema" and page.words[1:] == ["evaluate"] and "experiment1" not in offered(""):
                wrong.append("completion after 'bodyschema evaluate' lacks the experiments")
            if "--print-config" in page.options():
                wrong += configuration_is_checked(page, out)
            # What is said of an option stands on its line in the man page, not pushed in by a blank.
            page_text = (out / "man1" / f"{page.name}.1").read_text(encoding="utf-8")
            wrong += [f"{page.name}.1: a line begins with a blank: {line}" for line in page_text.splitlines()
                      if re.match(r" \S", line)]
            todo += [[*page.words, command] for command in page.subcommands()]
    print(f"{pages} pages of help", *wrong, sep="\n")
    return 1 if wrong or pages < len(programs) else 0


if __name__ == "__main__":
    sys.exit(main())
