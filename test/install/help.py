"""Every program and command explains itself with an example; completion knows every command.

usage: help.py MANUAL_PY SCRATCH_DIR PROGRAM...
"""
import importlib.util
import pathlib
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


def main():
    specification = importlib.util.spec_from_file_location("manual", sys.argv[1])
    manual = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(manual)
    out, programs = pathlib.Path(sys.argv[2]), sys.argv[3:]
    subprocess.run([sys.executable, sys.argv[1], out, "1.2.3", *programs], check=True, timeout=120)
    wrong, pages = [], 0
    for program in programs:
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
            offered = complete(out / "completions" / name, [name, *page.words[1:], ""])
            wrong += [f"completion after '{shown}' lacks {word}"
                      for word in [*page.subcommands(), "--help"] if word not in offered]
            todo += [[*page.words, command] for command in page.subcommands()]
    print(f"{pages} pages of help", *wrong, sep="\n")
    return 1 if wrong or pages < len(programs) else 0


if __name__ == "__main__":
    sys.exit(main())
