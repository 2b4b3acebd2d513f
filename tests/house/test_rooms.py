"""The house keeps its order: imports run downwards, no circle, and every name stands for one thing."""

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HOUSE = ROOT / "generator"

ROOMS = (
    "cli",
    "study",
    "citations",
    "bundle",
    "example_cases",
    "package_cache",
    "pipeline",
    "kernel_choice",
    "report",
    "identification",
    "analysis",
    "graphs",
    "check",
    "emit",
    "dynamics",
    "expression",
    "constraints",
    "symbolic",
    "robot",
    "oracle",
    "package",
    "output",
    "own_opensim",
    "own_process",
    "plotstyle",
    "render",
    "extras",
    "progress",
    "bounded_file",
    "input_file",
    "generator_fingerprint",
    "own_runtime",
    "option",
    "arrays",
    "errors",
    "escape",
    "linkwise_runtime",
)
"""Rooms from the top of the house to its ground: a room imports from rooms below it only."""

RUNTIME = (
    "native",
    "lagrangians",
    "dynamics",
    "certainty_calls",
    "motion_calls",
    "robot_calls",
    "control",
    "certainty",
    "motion",
    "constraints",
    "arrays",
    "kinematics",
    "answers",
    "rule",
    "",
)
"""The rooms inside linkwise_runtime, by the same rule; at the ground, what every package imports."""

DISTRIBUTIONS = ("linkwise", "linkwise_runtime")
FACE = {"__init__", "__main__"}
"""Public names and nothing else: they may look into every room."""

MODULES = sorted(path for path in HOUSE.rglob("*.py") if path.name != "__init__.py")


def name_of(path: Path) -> str:
    parts = path.relative_to(HOUSE).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__")


def imports(path: Path) -> Iterator[str]:
    """Modules of the house that a file imports, at its top, inside functions, or for types only."""
    package = name_of(path).split(".")[: -1 if path.name != "__init__.py" else None]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] in DISTRIBUTIONS)
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*start, *(node.module or "").split(".")]).rstrip(".")
            if source.split(".")[0] in DISTRIBUTIONS:
                for alias in node.names:
                    inner = HOUSE.joinpath(*source.split("."), alias.name)
                    is_module = inner.with_suffix(".py").is_file() or inner.is_dir()
                    yield f"{source}.{alias.name}" if is_module else source


def room_of(module: str) -> str:
    return (
        "linkwise_runtime" if module.startswith("linkwise_runtime") else [*module.split("."), "__init__"][1]
    )


def all_files() -> list[Path]:
    return sorted(HOUSE.rglob("*.py"))


def test_every_room_is_in_the_list() -> None:
    assert {room_of(name_of(path)) for path in all_files()} - FACE <= set(ROOMS)


def test_the_page_shows_the_rooms_in_this_order() -> None:
    page = (ROOT / "docs/house.md").read_text(encoding="utf-8")
    table = [line.split("|") for line in page.splitlines() if line.startswith("| `") and "`make " not in line]
    rooms = {name.removesuffix(".py"): row[2] for row in table for name in re.findall(r"`([\w.]+)`", row[1])}
    assert tuple(rooms) == ROOMS
    assert re.findall(r"`(\w+)`", rooms["linkwise_runtime"]) == [*filter(None, RUNTIME)]


def test_what_is_installed_has_every_room() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    folders = {name_of(path) for path in HOUSE.rglob("__init__.py")}
    assert set(settings["tool"]["setuptools"]["packages"]) == folders | {
        "linkwise.templates",
        "linkwise.examples",
    }
    own = tomllib.loads((HOUSE / "linkwise_runtime/pyproject.toml").read_text(encoding="utf-8"))
    runtime = {name for name in folders if name.startswith("linkwise_runtime")}
    assert set(own["tool"]["setuptools"]["packages"]) == runtime
    assert (HOUSE / "linkwise_runtime/LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


@pytest.mark.parametrize("room", ROOMS)
def test_imports_run_downwards_only(room: str) -> None:
    upwards = [
        f"{name_of(path)} imports {module}"
        for path in all_files()
        if room_of(name_of(path)) == room
        for module in imports(path)
        if room_of(module) != room
        and (room_of(module) in FACE or ROOMS.index(room_of(module)) < ROOMS.index(room))
    ]
    assert not upwards, f"not below {room}: {'; '.join(upwards)}"


def test_no_circle_of_modules_even_inside_a_room() -> None:
    below = {name_of(path): set(imports(path)) - {name_of(path)} for path in all_files()}
    while leaves := [name for name, needs in below.items() if not needs & below.keys()]:
        for name in leaves:
            del below[name]
    assert not below, f"these import each other in a circle: {', '.join(sorted(below))}"


def test_every_class_name_is_used_once() -> None:
    counts = Counter(
        node.name
        for path in MODULES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    )
    assert not [name for name, count in counts.items() if count > 1]


@pytest.mark.parametrize("room", RUNTIME)
def test_inside_the_runtime_too_imports_run_downwards_only(room: str) -> None:
    folder = HOUSE / "linkwise_runtime"

    def room_in(first: str) -> str:
        return first if (folder / first).is_dir() or first in RUNTIME else ""

    upwards = [
        f"{name_of(path)} imports {module}"
        for path in sorted(folder.rglob("*.py"))
        if room_in(path.relative_to(folder).with_suffix("").parts[0]) == room
        for module in imports(path)
        if RUNTIME.index(room_in(module.split(".")[1])) < RUNTIME.index(room)
    ]
    assert not upwards, f"not below {room or 'the ground'}: {'; '.join(upwards)}"


FRAGMENTS = re.compile(
    r"(?:The same|Likewise|Of|That|Those|Their|Its|Whose|Who|What|Which|Whether|Why|How|As|By|But|And)\b"
)
"""Beginnings of docstrings that lean on their neighbours, or leave out what is returned."""


def documentation(path: Path) -> Iterator[str]:
    """Yield the docstrings of a file, and the strings below what they tell of, with their lines."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        body = getattr(node, "body", None)
        for line in body if isinstance(body, list) else ():
            match line:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    yield f"{path.relative_to(ROOT)}:{line.lineno}: {text}"


@pytest.mark.parametrize(
    "folder", ["generator", "templates", "generated", "tests", "docs", "examples", "release"]
)
def test_documentation_begins_with_what_it_tells_of(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    told = [line for path in files for line in documentation(path)]
    assert told
    assert not [line for line in told if FRAGMENTS.match(line.split(": ", 1)[1])]


def test_what_tests_share_is_imported_by_its_folder() -> None:
    tests = ROOT / "tests"
    stems = {path.stem for path in tests.rglob("*.py")}
    for path in sorted((*tests.rglob("*.py"), *(ROOT / "docs").rglob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [str(node.module)]
            for first in (name.partition(".")[0] for name in names):
                places = (tests / first, tests / f"{first}.py", path.with_name(f"{first}.py"))
                assert first not in stems or any(place.exists() for place in places), f"{path}: {first}"
