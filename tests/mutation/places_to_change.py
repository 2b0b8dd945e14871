"""Where a source file can be changed, and how: what mutate.py samples from."""
import random
import re

LITERAL = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'|//[^\n]*|/\*.*?\*/', re.DOTALL)
COMPARISON = re.compile(r"(?<=[\w)\]] )(<=|>=|==|!=|<|>)(?= [\w(*&:\"'-])")
SIGN = re.compile(r"(?<=[\w)\]] )([+-])(?= [\w(])")
CONSTANT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?(?:e-?\d+)?)(?![\w.]*['\w])")
CONDITION = re.compile(r"\bif \((?!const |auto |constexpr)([^;{}\n]+)\)(?= [^\n]*[;{]$)")
STATEMENT = re.compile(r"(?m)^( +)((?!return|break|continue|using|case|throw|const |auto )"
                       r"(?:\+\+|--)?[\w.>\-\[\]:*]+(?:\([^;\n]*\)| (?:[+\-|&^]?=) [^;\n]+|\+\+);)$")
OTHER = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+"}


def blanked(text):
    """The text with strings and comments as blanks, every character at its place."""
    return LITERAL.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def other_constant(text):
    if text in ("0", "1"):
        return "1" if text == "0" else "0"
    if text == "0.0":
        return "1.0"
    return f"{2 * float(text):g}" if "." in text or "e" in text else str(int(text) + 1)


def mutations(path):
    """(offset, kind, before, after) of each place that can be changed."""
    text = path.read_text()
    code = blanked(text)
    for kind, pattern in (("comparison", COMPARISON), ("sign", SIGN)):
        for m in pattern.finditer(code):
            yield m.start(1), kind, m.group(1), OTHER[m.group(1)]
    for m in CONSTANT.finditer(code):
        if not code[code.rfind("\n", 0, m.start()) + 1:].startswith(("#", "template")):
            yield m.start(1), "constant", m.group(1), other_constant(m.group(1))
    for m in CONDITION.finditer(code):
        if m.group(1).count("(") == m.group(1).count(")"):
            before = text[m.start(1):m.end(1)]
            yield m.start(1), "condition", before, f"!({before})"
    for m in STATEMENT.finditer(code):
        before = text[m.start(2):m.end(2)]
        if not re.match(r"[\w:]+ [\w]+\(", before):
            yield m.start(2), "statement", before, ";"


def sample(tree, rooms, seed, count):
    """The kinds in turn, so that constants, which are many, do not crowd the others out."""
    found = {}
    for room in rooms:
        for path in sorted((tree / room).rglob("*.cpp")):
            for mutation in mutations(path):
                found.setdefault(mutation[1], []).append((room, path.relative_to(tree), *mutation))
    rng = random.Random(seed)
    for group in found.values():
        rng.shuffle(group)
    kinds = sorted(found)
    chosen = []
    while len(chosen) < count and any(found.values()):
        for kind in kinds:
            if found[kind] and len(chosen) < count:
                chosen.append(found[kind].pop())
    return chosen
