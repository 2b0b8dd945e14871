"""Markdown that one can read: lines, pages and table cells are short, and relative links resolve.

A line has at most 120 columns, a page at most 200 lines, a table cell at most 15 words. docs/notes/ and CHANGELOG.md
may be longer than a page. A link to a file needs the file, a link to a #heading needs the heading.
"""
import os
import pathlib
import re
import sys

COLUMNS, LINES, WORDS = 120, 200, 15
FENCE = re.compile(r"^ {0,3}(```|~~~)")
HEADING = re.compile(r"^#{1,6} +(.*?)(?: +#+)?$")
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(<?([^()\s<>]*(?:\([^()\s]*\)[^()\s<>]*)*)>?(?:\s+\"[^\"]*\")?\)")
CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)")
EXTERNAL = re.compile(r"^[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def prose(text):
    """Line number and line of what is not in a fenced block."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        match = FENCE.match(line)
        if match and fence in (None, match.group(1)):
            fence = None if fence else match.group(1)
        elif not fence:
            yield number, line


def anchors(text):
    """The anchors of a page's headings, as GitHub makes them."""
    found = set()
    for _, line in prose(text):
        match = HEADING.match(line)
        if not match:
            continue
        title = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", match.group(1)).replace("`", "")
        slug = stem = re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-")
        count = 0
        while slug in found:
            count += 1
            slug = f"{stem}-{count}"
        found.add(slug)
    return found


def wrong_link(target, page, root, text):
    """What is wrong with one target, or None."""
    if EXTERNAL.match(target):
        return None
    name, _, anchor = target.partition("#")
    path = (page.parent / name).resolve() if name else page
    if not path.exists():
        return f"there is no {name}"
    if not path.is_relative_to(root.resolve()):
        return f"{name} is outside the project"
    if anchor and path.suffix == ".md":
        if anchor not in anchors(path.read_text() if name else text):
            return f"{name or 'this page'} has no heading #{anchor}"
    return None


def check_form(name, text):
    """What is too long in a page: its lines, itself, the cells of its tables."""
    lines = text.splitlines()
    wrong = [f"{name}:{number}: {len(line)} columns; at most {COLUMNS}"
             for number, line in enumerate(lines, 1) if len(line) > COLUMNS]
    if len(lines) > LINES and name != "CHANGELOG.md" and not name.startswith("docs/notes/"):
        wrong.append(f"{name}: {len(lines)} lines; at most {LINES}: split it by subject")
    for number, line in prose(text):
        if not re.match(r" {0,3}\|", line):
            continue
        for cell in re.split(r"(?<!\\)\|", line.strip().strip("|")):
            words = [word for word in cell.split() if re.search(r"\w", word)]
            if len(words) > WORDS:
                wrong.append(f"{name}:{number}: a cell of {len(words)} words; at most {WORDS}: {cell.strip()}")
    return wrong


def check_page(page, root):
    text = page.read_text()
    name = page.relative_to(root).as_posix()
    wrong = check_form(name, text)
    for number, line in prose(text):
        for target in LINK.findall(CODE.sub("", line)):
            problem = wrong_link(target, page, root, text)
            if problem:
                wrong.append(f"{name}:{number}: {problem}")
    return wrong


def pages(root):
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith(("build", ".")))
        yield from (pathlib.Path(folder) / name for name in sorted(names) if name.endswith(".md"))


def main(root):
    found = list(pages(root))
    wrong = [sentence for page in found for sentence in check_page(page, root)]
    print("\n".join(wrong) or f"{len(found)} pages: lines, cells and links are as they must be")
    return 1 if wrong or not found else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve()))
