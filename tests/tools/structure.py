"""How large classes may grow. check(root) returns one line of text per class of the libraries that has become too large.

Run as a program, it checks the project: structure.py ROOT.
"""

import re
import sys
from pathlib import Path

FOLDERS = ["filter", "src", "smoother"]
MOST_MEMBERS = 15
MOST_FUNCTIONS = 25
FRAME = ("filter/filter.cpp", "std::optional<Estimate> Filter::process(")  # what happens to a frame
MOST_FRAME_LINES = 40

CLASS = re.compile(r"^(?:template <[^>]*>\s*)?(?:class|struct) (?:\w+::)*(\w+)(?: final)?(?:\s*:[^{;]*)?\s*\{", re.MULTILINE)


def without_comments(text):
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text)
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


def body_from(text, opening):
    """The text between the brace at `opening` and the one that closes it."""
    depth = 0
    for i in range(opening, len(text)):
        depth += {"{": 1, "}": -1}.get(text[i], 0)
        if depth == 0:
            return text[opening + 1 : i]
    raise ValueError("a brace that is never closed")


def statements(body):
    """Declarations of a class at its own level; what is in braces within them is left out."""
    depth, text = 0, ""
    for character in body:
        if character == "{":
            depth += 1
        elif character == "}":
            depth -= 1
            if depth == 0:
                text += "{}"
                if "(" in text and not re.search(r"[=,(]\s*\{\}$", text) or re.match(r"\s*(struct|class|enum)\b", text):
                    yield text
                    text = ""
        elif depth == 0:
            if character == ";":
                yield text
                text = ""
            else:
                text += character


def measure(body):
    """Numbers of members and of functions that a class declares."""
    members = functions = 0
    for statement in statements(body):
        statement = re.sub(r"^\s*(?:public|private|protected):", "", " ".join(statement.split())).strip()
        statement = re.sub(r"^(?:public|private|protected) ?:", "", statement).strip()
        if not statement or statement.startswith(("using ", "friend ", "static_assert", "struct ", "class ", "enum ")):
            continue
        if "= delete" in statement or "= default" in statement or statement.startswith("static constexpr"):
            continue
        names = re.findall(r"\b\w+_\s*(?=[={,]|$)", statement)
        if names and "(" not in statement.split(names[0])[0]:
            members += len(names)
        elif "(" in statement:
            functions += 1
    return members, functions


def check(root):
    faults = []
    for folder in FOLDERS:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in (".h", ".cpp"):
                continue
            text = without_comments(file.read_text(encoding="utf-8"))
            for match in CLASS.finditer(text):
                members, functions = measure(body_from(text, match.end() - 1))
                where = f"{file.relative_to(root)}: {match[1]}"
                if members > MOST_MEMBERS:
                    faults.append(f"{where} has {members} members, more than {MOST_MEMBERS}")
                if functions > MOST_FUNCTIONS:
                    faults.append(f"{where} has {functions} functions, more than {MOST_FUNCTIONS}")
    file, function = FRAME
    text = (root / file).read_text(encoding="utf-8")
    lines = body_from(text, text.index("{", text.index(function))).count("\n")
    if lines >= MOST_FRAME_LINES:
        faults.append(f"{file}: {function}...) has {lines} lines, {MOST_FRAME_LINES} or more")
    return faults


if __name__ == "__main__":
    found = check(Path(sys.argv[1]).resolve())
    print("\n".join(found) or "structure: no class is too large")
    sys.exit(1 if found else 0)
