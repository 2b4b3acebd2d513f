"""Room that each source file belongs to, the lines of it that are changed, and the tests that count.

A room of the house is a room here, with those of the runtime and the templates apart. The tests of a Python
file are those that reach the changed function; for what Python does not run, a room names its tests, cheap
ones first.
"""

import hashlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from mutation.mutants import Mutant, mutants
from mutation.tree import ROOT

HOUSE = "generator/linkwise/"
RUNTIME = "generator/linkwise_runtime/"
LINES = 100
"""Number of lines of which one is changed at least."""
LEAST = 20
"""Mutants of a room, however small: with fewer, one survivor would be more than 5 %."""


@dataclass(frozen=True)
class Room:
    """Files and folders below the project's root; tests, of what no coverage of Python tells."""

    places: tuple[str, ...]
    tests: tuple[str, ...] = ()


def _folder(name: str, *tests: str) -> Room:
    return Room((f"{HOUSE}{name}/",), tests)


C = (
    "tests/emit/test_control_c.py",
    "tests/emit/test_emitted_c.py",
    "tests/emit/test_loops.py",
    "tests/emit/test_sines.py",
    "tests/runtime/test_native.py",
    "tests/emit/test_impedance_c.py",
    "tests/runtime/test_passive_torque.py",
    "tests/robot/test_curves.py",
    "tests/check/test_check.py",
    "tests/numeric/test_regressors.py",
    "tests/runtime/test_motion_variances.py",
    "tests/emit/test_embedded.py",
)
ROOMS: dict[str, Room] = {
    "cli": _folder("cli"),
    "study": _folder("study"),
    "bundle": _folder("bundle"),
    "report": Room(
        (f"{HOUSE}report/", "templates/report/"),
        ("tests/report/test_pages.py", "tests/report/test_reduction.py", "tests/report/test_commands.py"),
    ),
    "identification": _folder("identification"),
    "analysis": _folder("analysis"),
    "graphs": _folder("graphs"),
    "check": _folder("check"),
    "oracle": _folder("oracle"),
    "emit": _folder("emit"),
    "package": _folder("package"),
    "dynamics": _folder("dynamics"),
    "expression": _folder("expression"),
    "constraints": _folder("constraints"),
    "symbolic": _folder("symbolic"),
    "robot": _folder("robot", "tests/robot/test_builtin.py", "tests/numeric/test_against_pinocchio.py"),
    "output": _folder("output"),
    "single-files": Room(
        tuple(
            f"{HOUSE}{name}.py"
            for name in (
                *(
                    "__init__",
                    "__main__",
                    "citations",
                    "package_cache",
                    "pipeline",
                    "kernel_choice",
                    "plotstyle",
                ),
                *("example_cases", "render", "extras", "option", "arrays"),
                *("progress", "bounded_file", "input_file", "generator_fingerprint"),
                *("errors", "escape", "own_opensim", "own_process", "own_runtime"),
            )
        )
    ),
    "runtime": Room((RUNTIME,)),
    "runtime/native": Room(
        (f"{RUNTIME}native/",), ("tests/runtime/test_native_module.py", "tests/runtime/test_native.py")
    ),
    "runtime/arrays": Room((f"{RUNTIME}arrays/",), ("tests/emit/test_exports.py",)),
    **{
        f"runtime/{name}": Room((f"{RUNTIME}{name}/",))
        for name in ("lagrangians", "control", "motion", "constraints", "kinematics", "answers", "rule")
    },
    "c": _folder("c", *C),
    "cmake": _folder("cmake", "tests/emit/test_cmake.py"),
    "templates": Room(
        (
            "templates/__init__.py",
            *(f"templates/{kind}/" for kind in ["c", "closed_forms", "energies", "formulas", "package"]),
        ),
        ("tests/emit/test_templates.py", "tests/runtime/test_import.py", "tests/runtime/test_calls.py", *C),
    ),
    "pages": Room(
        ("templates/analysis/", "templates/study/"),
        (
            "tests/study/test_page.py",
            "tests/analysis/test_page.py",
            "tests/analysis/test_shares.py",
            "tests/analysis/test_browser.py",
        ),
    ),
}
LEFT_OUT = {
    f"{HOUSE}py.typed": "empty",
    f"{RUNTIME}py.typed": "empty",
    f"{RUNTIME}LICENSE": "the project's",
    f"{RUNTIME}pyproject.toml": "what is packed, which tests/house/test_packaging.py looks at",
    "templates/analysis/report.css.j2": "how a page looks; that all of it can be read, tests of pages hold",
}
NOT_COUNTED = {
    "tests/emit/test_generated.py": "that a text changed, not that it became wrong",
    "tests/house/test_mutation.py": "of this sweep itself",
    **dict.fromkeys(
        (
            "tests/house/test_rooms.py",
            "tests/house/test_docs.py",
            "tests/house/test_pages.py",
            "tests/house/test_licences.py",
        ),
        "reads texts of the checkout, which are not changed",
    ),
    **dict.fromkeys(
        (
            "tests/house/test_trust.py",
            "tests/house/test_stated_figures.py",
            "tests/house/test_skipped.py",
            "tests/house/test_packaging.py",
        ),
        "reads texts of the checkout, which are not changed",
    ),
    "tests/runtime/test_runtime.py::test_a_package_and_its_user_are_typed_strictly": "mypy, in minutes",
}
"""Files of tests, or tests, whose failure is no catch, with the reason."""


def sources() -> list[str]:
    """Every source file, below the project's root."""
    paths = [
        path
        for top in (HOUSE, RUNTIME, "templates/")
        for path in sorted((ROOT / top).rglob("*"))
        if path.is_file()
    ]
    names = [path.relative_to(ROOT).as_posix() for path in paths]
    return [n for n in names if "__pycache__" not in n and not n.startswith(f"{HOUSE}templates/")]


def rooms_of(path: str) -> list[str]:
    """Names of the rooms that a file is in: of nested folders, the innermost alone."""
    lengths = {
        name: max(
            (
                len(place)
                for place in room.places
                if path == place or (path.startswith(place) and place[-1] == "/")
            ),
            default=0,
        )
        for name, room in ROOMS.items()
    }
    deepest = max(lengths.values())
    return [name for name, length in lengths.items() if length == deepest > 0]


def files_of(room: str) -> list[str]:
    """The files of a room that are changed."""
    return [path for path in sources() if path not in LEFT_OUT and room in rooms_of(path)]


def test_files() -> list[str]:
    """Files whose tests count, in order of their names."""
    paths = sorted((ROOT / "tests").rglob("test_*.py"))
    return [n for n in (path.relative_to(ROOT).as_posix() for path in paths) if n not in NOT_COUNTED]


@cache
def text_of(path: str) -> str:
    """Text of a file of the project."""
    return (ROOT / path).read_text(encoding="utf-8")


def lines_of(room: str) -> int:
    """Return how many lines a room has."""
    return sum(text_of(path).count("\n") for path in files_of(room))


def drawn(room: str) -> list[Mutant]:
    """Mutants of a room, one of a line: each line that can be changed has the same chance.

    The chance is a hash of the line's text, so that a line stays drawn when others change.
    """
    candidates = [item for path in files_of(room) for item in _by_chance(path)]
    wanted = max(LEAST, -(-lines_of(room) // LINES))
    found: list[Mutant] = []
    for _, group in sorted(candidates, key=lambda item: item[0]):
        possible = (mutant for mutant in group if mutant.parses(text_of(mutant.path)))
        if mutant := next(possible, None):
            found.append(mutant)
        if len(found) == wanted:
            break
    return found


def _by_chance(path: str) -> Iterator[tuple[str, list[Mutant]]]:
    """Yield the chance of each line and its mutants, both by a hash."""
    by_line: dict[int, list[Mutant]] = {}
    for mutant in mutants(path, text_of(path)):
        by_line.setdefault(mutant.line, []).append(mutant)
    seen = Counter[str]()
    for group in by_line.values():
        line = group[0].text
        seen[line] += 1
        yield chance(f"{path}: {line} {seen[line]}"), sorted(group, key=lambda mutant: chance(mutant.key))


def chance(text: str) -> str:
    """Hash by which a text is drawn before others."""
    return hashlib.sha256(text.encode()).hexdigest()
