"""cmake/public_headers.txt holds exactly the headers that a program includes, and what these include."""
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)
SHOWN = re.compile(r"<shaker/([\w/.]+\.hpp)>")
LIST = "cmake/public_headers.txt"


def listed(text: str) -> tuple[list[str], list[str]]:
    """What a program includes, and what these headers include, as the list has them."""
    parts = text.split("# What these include:")
    return tuple([line.split("+=")[1].strip() for line in part.splitlines() if line.startswith("INPUT")]
                 for part in parts)


def closure(entries: list[str], includes) -> set[str]:
    """The headers that `entries` reach. `includes` gives the project's headers that one header includes."""
    reached, open_ = set(), list(entries)
    while open_:
        header = open_.pop()
        if header not in reached:
            reached.add(header)
            open_ += includes(header)
    return reached


def faults(entries: list[str], others: list[str], shown: set[str], includes) -> list[str]:
    """One sentence for each. `shown`: headers that the examples and the documents include."""
    have = entries + others
    need = closure(sorted(set(entries) | shown), includes)
    return ([f"{h} stands twice in {LIST}" for h in sorted(set(have)) if have.count(h) > 1]
            + [f"{h} is missing in the first part of {LIST}: an example or a document includes it"
               for h in sorted(shown - set(entries))]
            + [f"{h} is missing in {LIST}: a public header includes it" for h in sorted(need - set(have) - shown)]
            + [f"{h} is private: take it out of {LIST}" for h in sorted(set(have) - need)])


def main(root: pathlib.Path) -> int:
    def includes(header: str) -> list[str]:
        path = root / header
        return INCLUDE.findall(path.read_text()) if path.exists() else []

    entries, others = listed((root / LIST).read_text())
    shown = {header for folder, kind in (("examples", "*.cpp"), ("examples", "*.md"), ("docs", "*.md"), (".", "README.md"))
             for path in (root / folder).glob(kind) for header in SHOWN.findall(path.read_text())}
    wrong = faults(entries, others, shown, includes)
    wrong += [f"{h} of {LIST} does not exist" for h in entries + others if not (root / h).exists()]
    print("\n".join(wrong) or f"{len(entries)} headers for programs, {len(others)} that these include")
    return 1 if wrong or not shown else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
