"""Small changes to a text that change what it says: one operator, number, sign, index or function at a time.

Comments, strings, annotations and preprocessor lines are left alone. A mutant is named by its file, the text
of its line and the change, so that it keeps its name when lines move.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

SWAPS = {
    **{"+": "-", "-": "+", "*": "/", "/": "*", "//": "/", "%": "*", "**": "*", "+=": "-=", "-=": "+="},
    **{"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "&&": "||", "||": "&&"},
    **{"===": "!==", "!==": "===", "|": "&", "&": "|", "++": "--"},
}
"""Operators with a space on either side; ++ without."""
OF_PYTHON = {"and": "or", "or": "and", "is": "is not", "in": "not in"}
OF_CMAKE = {
    **{"AND": "OR", "OR": "AND", "TRUE": "FALSE", "FALSE": "TRUE", "PUSH": "POP", "POP": "PUSH"},
    **{"EQUAL": "LESS", "STREQUAL": "STRLESS", "PRIVATE": "INTERFACE", "PUBLIC": "PRIVATE"},
}

WORDS = {
    **{
        "True": "False",
        "False": "True",
        "true": "false",
        "false": "true",
        "min": "max",
        "max": "min",
        "any": "all",
        "all": "any",
    },
    **{
        "sin": "cos",
        "cos": "sin",
        "break": "continue",
        "continue": "break",
        "ceil": "floor",
        "floor": "ceil",
    },
    **{"sorted": "list", "first": "last", "last": "first", "upper": "lower", "lower": "upper"},
}
TOKEN = r"""(?P<comment>{comment})
    |(?P<string>[rbfu]{{0,2}}(?:\"\"\".*?\"\"\"|'''.*?'''|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'))
    |(?P<jinja>\{{[%{{\#].*?[%}}\#]\}})
    |(?P<number>\b\d+(?:\.\d+)?(?:[eE][-+]?\d+)?\b)
    |(?P<word>\\?[A-Za-z_]\w*)
    |(?P<operator>\*\*|//|===|!==|<=|>=|=>|==|!=|&&|\|\||\+\+|\+=|-=|->|[-+*/%<>|&=:,(\[{{])
    |(?P<other>\S)"""
COMMENTS = {
    **dict.fromkeys(("py", "txt", "toml", "cmake"), r"\#[^\n]*"),
    **dict.fromkeys(("c", "h", "js", "html"), r"//[^\n]*|/\*.*?\*/"),
}
"""Rules by the ending of the text that is meant; other texts have none."""
CALL = re.compile(r"^[ \t]*([A-Za-z_][\w.]*\(.*\);)[ \t]*$", re.MULTILINE)
COMMAND = re.compile(
    r"^[ \t]*((?!if|else|endif|foreach|endforeach|function|endfunction)[a-z_]+\(.*\))[ \t]*$", re.MULTILINE
)
SCRIPT = re.compile(r"(?<=<script>).*?(?=</script>)", re.DOTALL)
C_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*|^[ \t]*\#(?:[^\n]*\\\n)*[^\n]*", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """One change: `old` at `start` of the text of `path` becomes `new`."""

    path: str
    start: int
    old: str
    new: str
    line: int
    text: str
    """The line it is on, stripped."""
    place: int
    """Number of this change among the same ones on this line, and on lines like it."""

    @property
    def key(self) -> str:
        """Name that survives moved lines."""
        return f"{self.path}: {self.text} [{self.old} -> {self.new or 'nothing'}, {self.place}]"

    def parses(self, text: str) -> bool:
        """Return whether what comes out is Python, where that is what it was."""
        if not self.path.endswith(".py"):
            return True
        try:
            ast.parse(self.applied(text))
        except SyntaxError:
            return False
        return True

    def applied(self, text: str) -> str:
        """The text with the change."""
        assert text[self.start : self.start + len(self.old)] == self.old
        return text[: self.start] + self.new + text[self.start + len(self.old) :]


@dataclass(frozen=True)
class Rules:
    """Rules of what is changed beside operators and words.

    share: of a float, by which it grows; names: whether digits and axes in names change, as in t12 and v3_x
    """

    share: float = 0.01
    names: bool = False


def mutants(path: str, text: str, rules: Rules = Rules()) -> Iterator[Mutant]:
    """All mutants of a text, in order; its kind is that of the path's ending."""
    seen: dict[tuple[str, str, str], int] = {}
    hidden = _hidden(path, text)
    starts = [0, *(m.end() for m in re.finditer("\n", text))]
    line = 0
    for start, old, new in sorted(set(_changes(path, text, rules))):
        if any(a <= start < b for a, b in hidden):
            continue
        while line + 1 < len(starts) and starts[line + 1] <= start:
            line += 1
        end = text.find("\n", start)
        shown = text[starts[line] : end if end >= 0 else len(text)].strip()
        if shown.startswith("@dataclass") or text[max(start - 7, 0) : start] == "strict=":
            continue  # promises that no result depends on
        if old == "|" and text[start:].startswith("| None"):
            continue  # a type: whatever imports it would fail
        place = seen[shown, old, new] = seen.get((shown, old, new), 0) + 1
        yield Mutant(path, start, old, new, line + 1, shown, place)


def _changes(path: str, text: str, rules: Rules) -> Iterator[tuple[int, str, str]]:
    kind_of_text = path.removesuffix(".j2").rpartition(".")[2]
    comment = COMMENTS.get(kind_of_text, "(?!)")
    tokens = re.finditer(TOKEN.format(comment=comment), text, re.DOTALL | re.VERBOSE)
    words = SWAPS | {"py": OF_PYTHON, "txt": OF_PYTHON, "cmake": OF_CMAKE}.get(kind_of_text, {})
    before: re.Match[str] | None = None
    for token, after in pairwise([*tokens, None]):
        assert token is not None
        kind, old, start = token.lastgroup, token[0], token.start()
        if kind == "jinja":
            yield from _jinja(old, start)
        elif kind == "number":
            yield start, old, _number(old, rules)
        elif kind == "word":
            if old.lstrip("\\") in WORDS and (old not in ("first", "last", "upper", "lower")):
                word = old.lstrip("\\")
                yield start, old, old.replace(word, WORDS[word])
            elif old in words:
                yield start, old, words[old]
            elif old in ("not", "NOT") and after is not None:
                yield start, text[start : after.start()], ""
            elif rules.names:
                yield from ((start, old, new) for new in _renamed(old))
        elif kind == "operator" and old in SWAPS:
            spaced = text[start - 1 : start] == " " and text[token.end() : token.end() + 1] in " \n"
            if spaced or old == "++":
                yield start, old, SWAPS[old]
            elif old == "-" and before is not None and before[0] in "=(,[{+-*/:returnelse":
                yield start, old, ""
        before = token
    if path.endswith(".py"):
        yield from _statements(text)
    for lines in {"js": [CALL], "c": [CALL], "h": [CALL], "cmake": [COMMAND]}.get(kind_of_text, []):
        for found in lines.finditer(text):
            if _balanced(found[1]):
                yield found.start(1), found[1], ""


def _balanced(text: str) -> bool:
    return text.count("(") == text.count(")") and text.count("{") == text.count("}")


def _number(old: str, rules: Rules) -> str:
    if re.fullmatch(r"\d+", old):
        return str(int(old) - 1) if int(old) > 1 else str(int(old) + 1)
    value = float(old)
    return repr(value * (1 + rules.share) if value else rules.share)


def _renamed(old: str) -> Iterator[str]:
    """Another intermediate value in place of this: t12 becomes t11, v3_x becomes v3_y."""
    found = re.fullmatch(r"([a-z]+)(\d+)(_[xyz])?", old)
    if found and found[1] not in ("float", "int", "log"):
        number = int(found[2])
        yield f"{found[1]}{number - 1 if number > 1 else number + 1}{found[3] or ''}"
        if found[3]:
            yield f"{found[1]}{number}_{'y' if found[3] == '_x' else 'x'}"


def _jinja(old: str, start: int) -> Iterator[tuple[int, str, str]]:
    """An expression left out, a condition turned round, a loop without its last or first round."""
    if old.startswith("{{"):
        yield start, old, ""
        for number in re.finditer(r"(?<![\w.])\d+", old):
            yield start + number.start(), number[0], str(int(number[0]) + 1)
    found = re.match(r"\{%-? *if (.*?) *-?%\}", old)
    if found:
        yield start + found.start(1), found[1], f"not ({found[1]})"
    found = re.match(r"\{%-? *for .*? in (.*?) *-?%\}", old)
    if found:
        yield start + found.start(1), found[1], f"({found[1]} | list)[1:]"


def _statements(text: str) -> Iterator[tuple[int, str, str]]:
    """Python statements left out, and conditions turned round."""
    lines = text.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))

    def offset(line: int, column: int) -> int:
        return starts[line - 1] + len(lines[line - 1].encode()[:column].decode())

    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.If, ast.IfExp)):
            test = node.test
            at = offset(test.lineno, test.col_offset)
            old = text[at : offset(test.end_lineno or 0, test.end_col_offset or 0)]
            yield at, old, f"not ({old})"
        plain = isinstance(node, ast.Expr) and not isinstance(node.value, (ast.Constant, ast.Yield))
        if plain or isinstance(node, (ast.Raise, ast.AugAssign, ast.Delete)):
            assert isinstance(node, ast.stmt)
            at = offset(node.lineno, node.col_offset)
            yield at, text[at : offset(node.end_lineno or 0, node.end_col_offset or 0)], "pass"


def _hidden(path: str, text: str) -> list[tuple[int, int]]:
    """Return the spans where nothing is changed: strings and annotations of Python, comments and preprocessor
    lines of C."""
    if path.endswith(".html.j2"):
        # Outside of scripts, only what is filled in.
        scripts = [m.span() for m in SCRIPT.finditer(text)]
        filled = [m.span() for m in re.finditer(r"\{[{%].*?[%}]\}", text)]
        kept = sorted([*scripts, *filled])
        ends = [0, *(end for _, end in kept)]
        return [
            (a, b) for a, b in zip(ends, [*(start for start, _ in kept), len(text)], strict=True) if a < b
        ]
    if re.search(r"\.(c|h)(\.j2)?$", path):
        found = [m.span() for m in C_COMMENT.finditer(text)]
        return [] if path.endswith(".h.j2") else found
    if not path.endswith(".py"):
        return []
    starts = [0]
    lines = text.splitlines(keepends=True)
    for line in lines:
        starts.append(starts[-1] + len(line))

    def span(node: ast.expr) -> tuple[int, int]:
        ends = (node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0)
        first, last = (starts[y - 1] + len(lines[y - 1].encode()[:x].decode()) for y, x in ends)
        return first, last

    hidden = []
    for node in ast.walk(ast.parse(text)):
        for note in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if note is not None:
                hidden.append(span(note))
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            hidden.append((starts[node.lineno - 1], starts[node.end_lineno or 0]))
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            hidden.append(span(node))
    return hidden
