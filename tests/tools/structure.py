"""How large classes may grow, how many constants the filter may have, and bounds of tests that hold whatever comes out.
check(root) returns one line of text per fault.

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
CONSTANTS = "filter"
MOST_CONSTANTS = 117

# A constant is a statement that gives `constexpr` names beginning with k a value; `// ...` beside or above it has the source.
CONSTANT = re.compile(r"^[^/\n]*\bconstexpr\s+([\w:]+|std::array<[^=]*>)\s+(k[A-Z]\w*)\s*(?:\[\w*\])?\s*=", re.MULTILINE)
SOURCE = re.compile(r"\b(chosen|measured|data sheets?|by definition|standard deviation over)\b", re.IGNORECASE)

# doctest's Approx(value).epsilon(share) allows a share of 1 + |value|. As a bound of per cent it is given by about().
LOOSE_BOUND = re.compile(r"\bApprox\b(?!.*\.scale\().*\.epsilon\((?!1e-([4-9]|1\d)\b)")
ABOUT = "tests/support/about.h"

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


def comment_of(lines, line):
    """What stands beside a line and directly above it."""
    first = line
    while first > 0 and lines[first - 1].lstrip().startswith("//"):
        first -= 1
    return " ".join(lines[first:line] + [lines[line].partition("//")[2]])


def constants_of(text):
    """Names of the constants in a source; and of those that are numbers with a fraction, and do not say where they come from."""
    lines = text.split("\n")
    names, without_source = [], []
    for match in CONSTANT.finditer(text):
        names.append(match[2])
        line = text.count("\n", 0, match.end())
        if match[1] == "double" and not SOURCE.search(comment_of(lines, line)):
            without_source.append(match[2])
    return names, without_source


def check_constants(root):
    faults, number = [], 0
    for file in sorted((root / CONSTANTS).rglob("*")):
        if file.suffix in (".h", ".cpp"):
            names, without_source = constants_of(file.read_text(encoding="utf-8"))
            number += len(names)
            faults += [f"{file.relative_to(root)}: {name} has no source: chosen, measured, data sheet" for name in without_source]
    if number > MOST_CONSTANTS:
        faults.append(f"{CONSTANTS}/ has {number} constants, more than {MOST_CONSTANTS}")
    return faults


def check_bounds(root):
    faults = []
    for file in sorted((root / "tests").rglob("*")):
        if file.suffix in (".h", ".cpp") and file != root / ABOUT:
            for line, text in enumerate(file.read_text(encoding="utf-8").split("\n"), 1):
                if LOOSE_BOUND.search(text):
                    faults.append(f"{file.relative_to(root)}:{line}: the bound holds for anything small; use about() of {ABOUT}")
    return faults


def check(root):
    faults = check_constants(root) + check_bounds(root)
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
    print("\n".join(found) or "structure: nothing is too large")
    sys.exit(1 if found else 0)
