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
                entry = self.sections[title][-1]
                entry[1] = f"{entry[1]} {line.strip()}".strip()
            else:
                self.sections[title].append([line.strip(), ""])
        self.description = self.description.strip()

    @property
    def name(self):
        return "-".join([pathlib.Path(self.words[0]).name, *self.words[1:]])

    def subcommands(self):
        return [term.split()[0] for term, _ in self.sections.get("Subcommands", [])]

    def options(self):
        """Option -> what its value is (`TEXT`, `TEXT:{auto,atlas}`), empty for a flag."""
        found = {}
        for items in self.sections.values():
            for term, _ in items:
                names, _, rest = term.partition(" ")
                value = rest.partition("Excludes:")[0].strip()
                for name in re.findall(r"--?[a-zA-Z][\w-]*", names) if term.startswith("-") else []:
                    found[name] = value
        return found

    def words_offered(self):
        """Subcommands, and experiments where the page lists them."""
        return [*self.subcommands(), *[term.partition(":")[0] for term, _ in self.sections.get("Experiments", [])]]


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line.startswith((".", "'")) else line
                     for line in text.splitlines())


def man_page(page, version, names):
    shown = " ".join([pathlib.Path(page.words[0]).name, *page.words[1:]])
    usage = page.usage.split(" ", 1)[1] if " " in page.usage else ""
    summary = " ".join(page.description.split()) or shown
    lines = [f'.TH {page.name.upper()} 1 "" "bodyschema {version}" "Body Schema"',
             ".SH NAME", f"{page.name} \\- {roff(summary)}",
             ".SH SYNOPSIS", f".B {roff(shown)}", roff(usage.removeprefix(" ".join(page.words[1:])).strip()),
             ".SH DESCRIPTION", roff(page.description)]
    for title, items in page.sections.items():
        lines.append(f".SH {title.upper()}")
        notes = False
        for term, description in items:
            if not title.startswith("Example"):
                lines += [".TP", f".B {roff(term)}", roff(description)]
            elif term.startswith(" "):
                lines += [".nf", roff(term), ".fi"]
            else:
                lines += [] if notes else [".SH NOTES"]
                notes = True
                lines += [roff(term)]
        if title == "Subcommands":
            related = ", ".join(f"{page.name}\\-{roff(c)}(1)" for c in page.subcommands())
            lines += [".PP", f"Each has its own page: {related}."]
    others = ", ".join(f"{roff(name)}(1)" for name in names if name != page.name)
    lines += [".SH SEE ALSO", *([others + ","] if others else []), "the pages in",
              roff("/usr/share/doc/bodyschema/docs/")]
    return "\n".join(lines) + "\n"


def completion(program, pages):
    """Commands, options after a dash, the choices of an option's value; file names everywhere else."""
    function = "_" + re.sub(r"\W", "_", program)
    cases, values = [], {}
    for page in pages:
        key, options = " ".join(page.words[1:]), page.options()
        cases.append(f"    '{key}') words='{' '.join(page.words_offered())}' options='{' '.join(sorted(options))}' ;;")
        for option, value in sorted(options.items()):
            if value:
                choices = re.search(r"\{(.*)\}", value)
                choices = choices.group(1).replace(",", " ") if choices else ""
                values.setdefault(choices, []).append(f"'{key} {option}'")
    after = [f"    {'|'.join(places)}) words='{choices}' options='' ;;" for choices, places in values.items()]
    subcommands = "|".join(f"'{' '.join(p.words[1:])}'" for p in pages if len(p.words) > 1) or "--none--"
    return "\n".join([
        f"# bash completion of {program}; generated from its --help",
        f"{function}() {{",
        "  local words='' options='' sub='' word typed=${COMP_WORDS[COMP_CWORD]}",
        '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do',
        f"    case \"${{sub:+$sub }}$word\" in {subcommands}) sub=\"${{sub:+$sub }}$word\" ;; esac",
        "  done",
        "  case $sub in", *cases, "  esac",
        "  # After an option that takes a value: its choices, else file names.",
        '  case "$sub ${COMP_WORDS[COMP_CWORD-1]}" in', *after, "  esac",
        "  [[ $typed == -* ]] && words=$options",
        '  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$typed")',
        "}",
        f"complete -o default -F {function} {program}", ""])


def main():
    out, version, programs = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
    (out / "man1").mkdir(parents=True, exist_ok=True)
    (out / "completions").mkdir(parents=True, exist_ok=True)
    pages_of = {}
    for program in programs:
        pages, todo = [], [[program]]
        while todo:
            page = Help(todo.pop(0))
            pages.append(page)
            todo += [[*page.words, command] for command in page.subcommands()]
        pages_of[pathlib.Path(program).name] = pages
    for name, pages in pages_of.items():
        for page in pages:
            (out / "man1" / f"{page.name}.1").write_text(man_page(page, version, pages_of), encoding="utf-8")
        (out / "completions" / name).write_text(completion(name, pages), encoding="utf-8")


if __name__ == "__main__":
    main()
