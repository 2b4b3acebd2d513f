"""Tests that reach a line: each file of tests runs under coverage.py, anew when its text changes.

Kept by the text of the line and by the function's name, not by number, so that it stays true while lines
move. What programs of the tests reach counts for the test that runs them, what fixtures of many tests reach
for every test of their file.
"""

import ast
import hashlib
import json
import os
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any

from mutation.tree import FORKING, ROOT, Tree, say

HOUSE = "generator"
IMPORT = 0.7
"""Seconds that importing a file of tests takes."""
SLOW = 1800
"""Seconds of processor time for one file of tests."""
SETTINGS = """[run]
data_file = {folder}/reached
parallel = true
context = ${{PYTEST_CURRENT_TEST-}}
include = {folder}/linkwise/*, */linkwise_runtime/*
disable_warnings = couldnt-parse, no-data-collected, module-not-measured, already-imported, dynamic-conflict
patch = _exit, fork
"""
"""Settings of programs that tests start; the runtime is also copied into packages, which are anywhere."""


@dataclass(frozen=True)
class Reached:
    """Lines and functions that one file of tests reaches.

    seconds: of the processor, of each of its tests; functions: of a source, by name, "" for what runs at
    its import: tests, or "" where every test of the file may depend on it; lines: the same of lines within
    functions, by their text, None for all tests that reach the function
    """

    digest: str
    seconds: dict[str, float]
    functions: dict[str, dict[str, list[str]]]
    lines: dict[str, dict[str, list[str] | None]]

    def of_line(self, path: str, function: str, text: str) -> set[str] | None:
        """Tests that reach a line within a function; None where none does."""
        if text not in self.lines.get(path, {}):
            return None
        tests = self.lines[path][text]
        return set(self.functions[path].get(function, ()) if tests is None else tests)

    @property
    def opening(self) -> float:
        """Seconds before the first test: the import, and what that takes more than most, for fixtures."""
        first = next(iter(self.seconds.values()), 0.0)
        return IMPORT + max(0.0, first - self._usual)

    @property
    def own(self) -> dict[str, float]:
        """Seconds of each test without those of the opening."""
        return {
            name: seconds if at else min(seconds, self._usual)
            for at, (name, seconds) in enumerate(self.seconds.items())
        }

    @property
    def _usual(self) -> float:
        return median(self.seconds.values()) if self.seconds else 0.0


def digest(path: Path) -> str:
    """Short hash of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def digest_of_code(path: Path) -> str:
    """Short hash of what a file does: of Python without docstrings, comments and layout."""
    return _bare_digest(path.read_text(encoding="utf-8")) if path.suffix == ".py" else digest(path)


@cache
def _bare_digest(text: str) -> str:
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [one for one in body if not _is_text(one)]  # type: ignore[attr-defined]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:16]


def _is_text(node: ast.stmt) -> bool:
    """Return whether a statement is a docstring, or a string that stands below what it tells of."""
    text = node.value if isinstance(node, ast.Expr) else None
    return isinstance(text, ast.Constant) and isinstance(text.value, str)


def digest_of_test(path: Path, test: str) -> str:
    """Short hash of a test and of what its file has beside tests and imports: other tests may change."""
    pieces = _pieces(path.read_text(encoding="utf-8"))
    kept = [text for name, text in pieces if name == test or not name.startswith("test_")]
    return hashlib.sha256("\n".join(kept).encode()).hexdigest()[:16]


@cache
def _pieces(text: str) -> tuple[tuple[str, str], ...]:
    """Name and text of what a file has beside imports; "" for what has none."""
    lines, found = text.splitlines(), []
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Import | ast.ImportFrom):
            first = min([node.lineno, *(one.lineno for one in getattr(node, "decorator_list", []))])
            found.append((getattr(node, "name", ""), "\n".join(lines[first - 1 : node.end_lineno])))
    return tuple(found)


class Map:
    """Map of what each file of tests reaches, kept in a folder."""

    def __init__(self, folder: Path) -> None:
        """Take what is there; files that changed since are not in it."""
        self.folder = folder
        self.files: dict[str, Reached] = {}
        folder.mkdir(parents=True, exist_ok=True)
        for file in sorted(folder.glob("*.json")):
            name = file.stem.replace("+", "/") + ".py"
            reached = Reached(**json.loads(file.read_text()))
            if (ROOT / name).is_file() and digest(ROOT / name) == reached.digest:
                self.files[name] = reached

    def add(self, name: str, tree: Tree) -> None:
        """Run one file of tests, and keep what it reaches."""
        reached = _reached(name, tree)
        self.files[name] = reached
        kept = self.folder / (name.removesuffix(".py").replace("/", "+") + ".json")
        kept.write_text(json.dumps(vars(reached)))

    def tests(self, path: str, line: int) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]:
        """Tests that reach a line, else its function, with their seconds, and the other tests of their files.

        These may use what those kept. What is run at import alone may matter to all that use the module; a
        function's header, as its defaults, to those that call it.
        """
        source = (ROOT / path).read_text(encoding="utf-8")
        function, text = name_at(source, line, headed=True), source.splitlines()[line - 1].strip()
        is_known = any(function in reached.functions.get(path, {}) for reached in self.files.values())
        of_line = {name: reached.of_line(path, function, text) for name, reached in self.files.items()}
        is_reached = bool(function) and any(of_line.values())
        near: list[tuple[str, float]] = []
        far: list[tuple[str, float]] = []
        for file, reached in self.files.items():
            here = reached.functions.get(path, {})
            if is_reached:
                names = of_line[file] or set()
            elif function and is_known:
                names = set(here.get(function, ()))
            elif function:
                names = {name for found in here.values() for name in found if name}
            else:
                names = {""} if here else set()
            for item in reached.own.items() if names else ():
                (near if item[0] in names or "" in names else far).append(item)
        return near, far


@cache
def _functions(text: str) -> list[tuple[int, int, int, str]]:
    """Line of the header of each function, first and last of its body, and its name; outer ones first."""
    found: list[tuple[int, int, int, str]] = []

    def visit(node: ast.AST, above: str) -> None:
        for child in ast.iter_child_nodes(node):
            name = above
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                name = f"{above}.{child.name}".removeprefix(".")
                if not isinstance(child, ast.ClassDef):
                    found.append((child.lineno, child.body[0].lineno, child.end_lineno or 0, name))
            visit(child, name)

    visit(ast.parse(text), "")
    return found


def name_at(text: str, line: int, headed: bool = False) -> str:
    """Name of the innermost function whose body, or header, has this line; "" for what runs at import."""
    inside = [
        name
        for header, first, last, name in _functions(text)
        if (header if headed else first) <= line <= last
    ]
    return inside[-1] if inside else ""


def _spent() -> float:
    """Seconds of processor time of this process and the programs that it waited for: no other work counts."""
    return sum(os.times()[:4])


class Watch:
    """Tells coverage which test runs, and how long each takes."""

    def __init__(self) -> None:
        self.now = ""
        self.seconds: dict[str, float] = defaultdict(float)

    @contextmanager
    def _as(self, name: str) -> Iterator[None]:
        before, self.now = self.now, name
        self.tell()
        try:
            yield
        finally:
            self.now = before
            self.tell()

    def tell(self) -> None:
        """Tell what measures in this process which test runs."""
        import coverage

        if cover := coverage.Coverage.current():
            cover.switch_context(self.now)

    def pytest_configure(self, config: Any) -> None:
        """Wrap what pytest calls; written so that this module does not need pytest."""
        import pytest

        watch = self

        class Hooks:
            @pytest.hookimpl(wrapper=True)
            def pytest_runtest_protocol(self, item: Any) -> Any:
                start = _spent()
                with watch._as(test_of(item.nodeid)):
                    result = yield
                watch.seconds[test_of(item.nodeid)] += _spent() - start
                return result

            @pytest.hookimpl(wrapper=True)
            def pytest_fixture_setup(self, fixturedef: Any) -> Any:
                if fixturedef.scope == "function":
                    return (yield)
                with watch._as(""):
                    return (yield)

        config.pluginmanager.register(Hooks())


def test_of(name: str) -> str:
    """Name of a test without its parameters and its phase."""
    return name.partition("[")[0].partition(" (")[0]


test_of.__test__ = False  # type: ignore[attr-defined]


def _reached(name: str, tree: Tree) -> Reached:
    folder = tree.folder / "coverage"
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    settings, seconds = folder / "coveragerc", folder / "seconds.json"
    settings.write_text(
        SETTINGS.format(folder=folder).replace(f"{folder}/linkwise", f"{tree.folder}/linkwise")
    )

    def work(pytest_main: Callable[..., int]) -> int:
        import coverage

        os.environ["COVERAGE_PROCESS_START"] = str(settings)
        cover = coverage.Coverage(config_file=str(settings))
        cover.start()
        watch = Watch()
        os.register_at_fork(after_in_child=watch.tell)  # after coverage's own, which starts without a context
        code = pytest_main(["-m", "not ship", name], [watch])
        cover.stop()
        cover.save()
        seconds.write_text(json.dumps(watch.seconds))
        return code

    code = tree.forked(work, SLOW)
    if not seconds.is_file():
        say(f"{name}: ended with {code} under coverage, and is not in the map")
        return Reached(digest(ROOT / name), {}, {}, {})
    with FORKING:
        functions, lines = _collected(folder, tree)
    return Reached(digest(ROOT / name), json.loads(seconds.read_text()), functions, lines)


def _collected(
    folder: Path, tree: Tree
) -> tuple[dict[str, dict[str, list[str]]], dict[str, dict[str, list[str] | None]]]:
    """Functions and lines that were reached, of all processes' data."""
    import coverage

    found: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    lines: dict[str, dict[tuple[str, str], set[str]]] = defaultdict(lambda: defaultdict(set))
    for file in folder.glob("reached*"):
        data = coverage.CoverageData(str(file))
        try:
            data.read()
        except coverage.CoverageException:
            continue  # of a process that was killed while it wrote
        for measured in data.measured_files():
            path = _source(measured, tree)
            if path is None:
                continue
            text = (ROOT / path).read_text(encoding="utf-8")
            numbered = text.splitlines()
            for line, contexts in data.contexts_by_lineno(measured).items():
                tests = {test_of(part) for part in contexts}
                tests, name = {test if "::" in test else "" for test in tests}, name_at(text, line)
                found[path][name] |= tests
                if name:
                    lines[path][name, numbered[line - 1].strip()] |= tests
    functions = {
        path: {name: sorted(tests) for name, tests in inner.items()} for path, inner in found.items()
    }
    by_line = {
        path: {
            line: None if tests == found[path][name] else sorted(tests)
            for (name, line), tests in inner.items()
        }
        for path, inner in lines.items()
    }
    return functions, by_line


def _source(measured: str, tree: Tree) -> str | None:
    """The project's file that this one is, or is a copy of."""
    own = f"{tree.folder}/linkwise/"
    inner = (
        f"linkwise/{measured.removeprefix(own)}"
        if measured.startswith(own)
        else "linkwise_runtime/" + measured.rpartition("/linkwise_runtime/")[2]
    )
    path = f"{HOUSE}/{inner}"
    return path if (ROOT / path).is_file() and path.endswith(".py") else None
