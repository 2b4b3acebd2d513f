"""Results of compilers are kept by all that they are made of, and a file of tests leaves no memory."""

import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from conftest import SHARED, forget_packages, held_megabytes
from helpers import kept
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

COMPILER = """#!/bin/sh
[ "$1" = --version ] && echo "a compiler, version 1" && exit
echo "$@" >> {said}
grep -rqs wrong {sources} && echo "error: wrong" >&2 && exit 1
while [ $# -gt 0 ]; do [ "$1" = -o ] && made="$2"; shift; done
if [ -n "$made" ]; then echo made > "$made"; echo stack > "${{made%.*}}.su"; fi
"""


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A compiler that says in a file what it was asked for, and refuses what is wrong."""
    monkeypatch.setattr(kept, "CACHE", tmp_path / "kept")
    program, sources = tmp_path / "compiler", tmp_path / "sources"
    program.write_text(COMPILER.format(said=tmp_path / "said", sources=sources))
    program.chmod(0o755)
    (sources / "below").mkdir(parents=True)
    (sources / "robot.c").write_text("int a;")
    (sources / "below" / "robot.h").write_text("int b;")
    return str(program)


def times(folder: Path) -> int:
    """Count how often the compiler ran."""
    said = folder / "said"
    return len(said.read_text().splitlines()) if said.is_file() else 0


def test_it_is_made_once_with_all_that_stands_beside_it(compiler: str, tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        kept.run_kept([compiler, "-c", tmp_path / "sources/robot.c"], tmp_path / name / f"{name}.o")
        assert (tmp_path / name / f"{name}.o").read_text() == "made\n"
        assert (tmp_path / name / f"{name}.su").read_text() == "stack\n"
    assert times(tmp_path) == 1


@pytest.mark.parametrize("what", ["sources/robot.c", "sources/below/robot.h", "included/more.h", "named.h"])
def test_it_is_made_again_where_any_text_differs(compiler: str, what: str, tmp_path: Path) -> None:
    (tmp_path / "included").mkdir()
    for name in ("included/more.h", "named.h"):
        (tmp_path / name).write_text("int c;")
    including = (f"-I{tmp_path / 'included'}", "-include", tmp_path / "named.h")
    command = [compiler, *including, f'-DSOURCE="{tmp_path / "sources/robot.c"}"']
    for count in (1, 2):
        kept.run_kept(command, tmp_path / "made.o")
        assert times(tmp_path) == count
        (tmp_path / what).write_text("int changed;")


def test_it_is_made_again_by_another_compiler_or_with_other_words(compiler: str, tmp_path: Path) -> None:
    source = tmp_path / "sources/robot.c"
    kept.run_kept([compiler, source], tmp_path / "made.o")
    kept.run_kept([compiler, "-O1", source], tmp_path / "made.o")
    kept.run_kept([compiler, source])
    assert times(tmp_path) == 3
    Path(compiler).write_text(Path(compiler).read_text().replace("version 1", "version 12"))
    kept.run_kept([compiler, source], tmp_path / "made.o")
    assert times(tmp_path) == 4


def test_a_failure_is_told_each_time(compiler: str, tmp_path: Path) -> None:
    (tmp_path / "sources/below/robot.h").write_text("wrong")
    for _ in range(2):
        with pytest.raises(AssertionError, match="error: wrong"):
            kept.run_kept([compiler, tmp_path / "sources/robot.c"], tmp_path / "made.o")
    assert not list((tmp_path / "kept").iterdir())


def test_of_a_list_those_are_run_that_were_not_run_before(compiler: str, tmp_path: Path) -> None:
    asked: list[Sequence[Sequence[str]]] = []

    def run_all(commands: Sequence[Sequence[str]], tell: object) -> None:
        asked.append(commands)
        if any("-wrong" in command for command in commands):
            raise RuntimeError("wrong")
        for command in commands:
            Path(command[-1]).write_text("made")

    run, source, made = kept.keeping(run_all), str(tmp_path / "sources/robot.c"), str(tmp_path / "made.o")
    first, second = [compiler, source, "-o", made], [compiler, "-O1", source, "-o", made]
    run([first], lambda _: None)
    Path(made).unlink()
    run([first, second], lambda _: None)
    assert asked == [[first], [second]]
    for _ in range(2):
        with pytest.raises(RuntimeError, match="wrong"):
            run([[compiler, "-wrong", source, "-o", made]], lambda _: None)
    assert len(asked) == 4
    with pytest.raises(RuntimeError, match="wrong"):  # in the words of what runs it
        run([["/no/compiler", "-wrong", "-o", made]], lambda _: None)
    assert len(asked) == 5


def test_packages_of_a_file_of_tests_are_forgotten_and_those_of_the_session_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = generate(read_system("planar1"), ["numpy"])
    for name in ("own", "shared"):
        write_package(files, tmp_path / name)
    monkeypatch.setitem(SHARED, "planar1 of this test", tmp_path / "shared")
    own, shared = (import_package(tmp_path / name) for name in ("own", "shared"))
    for package in (own, shared):
        package.load("numpy")
    forget_packages()
    assert not [name for name in sys.modules if name.startswith(own.__name__)]
    assert not [finder for finder in sys.meta_path if getattr(finder, "name", "") == own.__name__]
    assert sys.modules[shared.__name__] is shared
    assert import_package(tmp_path / "own") is not own


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_memory_that_is_held_is_told() -> None:
    before = held_megabytes()
    held = bytearray(b"x") * (64 << 20)
    assert 60 <= held_megabytes() - before <= 70
    assert len(held) == 64 << 20
