#!/usr/bin/env python3
"""Man pages and bash completion from the programs' own --help, so that there is one source.

usage: manual.py OUT VERSION PROGRAM...
Writes OUT/man1/<program>[-<subcommand>].1 and OUT/completions/<program>.
"""
import pathlib
import re
import subprocess
import sys


class Help:
    """What one `--help` (of CLI11's layout) says."""

    def __init__(self, words):
        self.words = words
        text = subprocess.run([*words, "--help"], capture_output=True, encoding="utf-8", check=True,
                              timeout=30).stdout
        self.sections = {}  # title -> [(term, description)], or text for a section in prose
        self.description, self.usage = "", ""
        title = None
        for line in text.splitlines():
            heading = re.fullmatch(r"(?:\[Option Group: )?([A-Z][\w -]*)\]?:", line)
            item = re.match(r" {1,4}(?! )(\S.*?)(?: {2,}(\S.*))?$", line)
            if line.startswith("Usage:"):
                self.usage = line[len("Usage:"):].strip()
            elif heading:
                title = heading.group(1).capitalize()
                self.sections[title] = []
            elif title is None:
                self.description += line.strip() + "\n"
            elif not line.strip():
                continue
            elif title.startswith("Example"):
                self.sections[title].append([line, ""])  # the footer: as it stands
            elif item:
                self.sections[title].append([item.group(1), item.group(2) or ""])
            elif self.sections[title]:
                self.sections[title][-1][1] += " " + line.strip()
            else:
                self.sections[title].append([line.strip(), ""])
        self.description = self.description.strip()

    @property
    def name(self):
        return "-".join([pathlib.Path(self.words[0]).name, *self.words[1:]])

    def subcommands(self):
        return [term.split()[0] for term, _ in self.sections.get("Subcommands", [])]

    def options(self):
        words = []
        for items in self.sections.values():
            for term, _ in items:
                if term.startswith("-"):
                    words += re.findall(r"--?[a-zA-Z][\w-]*", term.split(" ")[0])
        return words


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line.startswith((".", "'")) else line
                     for line in text.splitlines())


def man_page(page, version):
    shown = " ".join([pathlib.Path(page.words[0]).name, *page.words[1:]])
    usage = page.usage.split(" ", 1)[1] if " " in page.usage else ""
    summary = " ".join(page.description.split()) or shown
    lines = [f'.TH {page.name.upper()} 1 "" "bodyschema {version}" "Body Schema"',
             ".SH NAME", f"{page.name} \\- {roff(summary)}",
             ".SH SYNOPSIS", f".B {roff(shown)}", roff(usage.removeprefix(" ".join(page.words[1:])).strip()),
             ".SH DESCRIPTION", roff(page.description)]
    for title, items in page.sections.items():
        lines.append(f".SH {title.upper()}")
        for term, description in items:
            if not title.startswith("Example"):
                lines += [".TP", f".B {roff(term)}", roff(description)]
            elif term.startswith(" "):
                lines += [".nf", roff(term), ".fi"]
            else:
                lines += [roff(term)]
        if title == "Subcommands":
            related = ", ".join(f"{page.name}\\-{roff(c)}(1)" for c in page.subcommands())
            lines += [".PP", f"Each has its own page: {related}."]
    return "\n".join(lines) + "\n"


def completion(program, pages):
    """Options of the subcommand being typed; file names everywhere else."""
    function = "_" + re.sub(r"\W", "_", program)
    cases = []
    for page in pages:
        key = f"'{' '.join(page.words[1:])}'"
        words = " ".join(sorted(set(page.options())) + page.subcommands())
        cases.append(f"    {key}) words='{words}' ;;")
    subcommands = "|".join(f"'{' '.join(p.words[1:])}'" for p in pages if len(p.words) > 1) or "--none--"
    return "\n".join([
        f"# bash completion of {program}; generated from its --help",
        f"{function}() {{",
        "  local words='' sub='' word",
        '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do',
        f"    case \"${{sub:+$sub }}$word\" in {subcommands}) sub=\"${{sub:+$sub }}$word\" ;; esac",
        "  done",
        "  case $sub in", *cases, "  esac",
        '  mapfile -t COMPREPLY < <(compgen -W "$words" -- "${COMP_WORDS[COMP_CWORD]}")',
        "}",
        f"complete -o default -F {function} {program}", ""])


def main():
    out, version, programs = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
    (out / "man1").mkdir(parents=True, exist_ok=True)
    (out / "completions").mkdir(parents=True, exist_ok=True)
    for program in programs:
        pages, todo = [], [[program]]
        while todo:
            page = Help(todo.pop(0))
            pages.append(page)
            todo += [[*page.words, command] for command in page.subcommands()]
        for page in pages:
            (out / "man1" / f"{page.name}.1").write_text(man_page(page, version), encoding="utf-8")
        name = pathlib.Path(program).name
        (out / "completions" / name).write_text(completion(name, pages), encoding="utf-8")


if __name__ == "__main__":
    main()
