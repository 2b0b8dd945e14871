"""Files that one can read: a source file has at most 400 lines, a function at most 60.

The length of a function is that of its definition, from the line of its type or name to its last brace. Read are the
C++ and Python files of the rooms; C++ is read by its braces, without a compiler.
"""
import ast
import pathlib
import re
import sys

FILE, FUNCTION = 400, 60
ROOMS = ("base", "bench", "cli", "config", "daemon", "drivers", "estimator", "examples", "gateway", "mqtt", "protocol",
         "python", "record", "report", "sim", "tests", "web")
# What a C++ file has apart from code: comments, strings, characters (1'000 is none), preprocessor lines.
APART = re.compile(r"""//[^\n]*|/\*.*?\*/|R"(?P<end>[^(]*)\(.*?\)(?P=end)"|"(?:\\.|[^"\\\n])*"|(?<!\w)'(?:\\.|[^'\\\n])+'"""
                   r"|(?m:^[ \t]*\#(?:[^\n]*\\\n)*[^\n]*)", re.DOTALL)
TYPE = re.compile(r"(inline\s+)?(namespace|struct|class|union|enum)\b")
CONTROL = re.compile(r"(if|for|while|switch|else|catch|do|try|return)\b")


def blanked(text: str) -> str:
    """C++ without what is no code, with the same lines."""
    return APART.sub(lambda match: re.sub(r"[^\n]", " ", match.group()), text)


def begins_function(head: str) -> bool:
    """Whether the brace after `head`, which begins after the last statement, opens a function."""
    head = re.sub(r"^(template\s*<[^{}]*>\s*)+|alignas\([^)]*\)", "", head.strip())
    return "(" in head and not CONTROL.match(head) and not TYPE.match(head)


def cpp_functions(text: str):
    """First line, number of lines and head of each function; lambdas count with what holds them."""
    code = blanked(text)
    start, parentheses, inside, open_blocks = 0, 0, False, []
    for at, character in enumerate(code):
        if character in "()":
            parentheses += 1 if character == "(" else -1
        elif character == ";" and parentheses == 0:
            start = at + 1
        elif character == "{":
            head = code[start:at]
            function = parentheses == 0 and not inside and begins_function(head)
            open_blocks.append((function, start + len(head) - len(head.lstrip()), parentheses, inside))
            inside, parentheses, start = inside or function, 0, at + 1
        elif character == "}":
            function, began, parentheses, inside = open_blocks.pop()
            start = at + 1
            if function:
                yield (code.count("\n", 0, began) + 1, code.count("\n", began, at) + 1,
                       " ".join(code[began:code.find("{", began)].split()))
    if open_blocks:
        raise ValueError("its braces do not match")


def python_functions(text: str):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.lineno, node.end_lineno - node.lineno + 1, node.name


def main(root: pathlib.Path) -> int:
    wrong, files, functions = [], 0, 0
    for path in sorted(path for room in ROOMS for path in (root / room).rglob("*")
                       if path.suffix in (".cpp", ".hpp", ".py") and path.is_file()):
        relative, text = path.relative_to(root), path.read_text()
        files += 1
        lines = text.count("\n")
        if lines > FILE:
            wrong.append(f"{relative}: {lines} lines, at most {FILE}")
        for line, length, name in (python_functions if path.suffix == ".py" else cpp_functions)(text):
            functions += 1
            if length > FUNCTION:
                wrong.append(f"{relative}:{line}: {name[:60]} has {length} lines, at most {FUNCTION}")
    print("\n".join(wrong) or f"{files} files with {functions} functions, none too long")
    return 1 if wrong or functions == 0 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
