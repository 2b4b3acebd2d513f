"""`make mutate` visits every room, trusts no test that fails by itself, and goes on where it stopped."""

import json
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mutation import rooms, verdicts
from mutation.decide import Decider
from mutation.mutants import Mutant, mutants
from mutation.order import in_order
from mutation.reach import Map, Reached, digest, digest_of_code, digest_of_test, name_at
from mutation.rooms import LEFT_OUT, NOT_COUNTED, ROOMS, drawn, rooms_of, sources
from mutation.tree import ROOT, Ended
from mutation.verdicts import END, HEAD, MARK, Record, explained

HOUSE = {
    "generator/linkwise/__init__.py": "",
    "generator/linkwise/errors.py": "def kept(a):\n    return a + 1\n\n\ndef lost(a):\n    return a * 3\n",
    "generator/linkwise/progress.py": """
import linkwise
steps = linkwise.__dict__.setdefault("steps", [])
steps.append(7)
FIRST = steps[0]
""",
    "generator/linkwise_runtime/__init__.py": "",
    "generator/linkwise_runtime/units.py": "def copied(a):\n    return a - 2\n",
    "templates/a.txt.j2": "",
    "docs/trust.md": f"before\n{MARK}an older table\n{END}after\n",
    "tests/test_imports.py": "import linkwise.progress\n\n\ndef test_none():\n    pass\n",
    "tests/test_one.py": """
import importlib.util, pathlib, shutil, subprocess, sys
import linkwise_runtime
from linkwise.errors import kept, lost
HERE = pathlib.Path(linkwise_runtime.__file__).parent

def test_program():
    program = "from linkwise.errors import kept; print(kept(1))"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stdout == "2\\n"

def test_copy(tmp_path):
    (tmp_path / "linkwise_runtime").mkdir()
    shutil.copy(HERE / "units.py", tmp_path / "linkwise_runtime/units.py")
    spec = importlib.util.spec_from_file_location("copied", tmp_path / "linkwise_runtime/units.py")
    spec.loader.exec_module(module := importlib.util.module_from_spec(spec))
    assert module.copied(5) == 3

def test_looks_away():
    assert lost(2) > 0

def test_fails_now_and_then():
    lost(2)
    count = pathlib.Path("count.txt")
    count.write_text((count.read_text() if count.exists() else "") + "x")
    assert len(count.read_text()) != 2
""",
}
"""A house with a function that a program runs, one that a package carries, one that no test looks at, and a
module that, changed, can be imported at the second time alone."""
SWEEP = "import mutation.tree as t; t.HEAVY = ('pytest',); from mutation.run import main; main()"


def changes(path: str, text: str) -> set[tuple[str, str]]:
    return {(mutant.old, mutant.new) for mutant in mutants(path, text)}


def test_a_source_is_in_one_room_or_left_out_for_a_reason() -> None:
    found = {path: rooms_of(path) for path in sources()}
    assert not {path: of for path, of in found.items() if len(of) != 1 and not LEFT_OUT.get(path)}


def test_what_a_room_or_a_reason_names_is_there() -> None:
    named = {place for room in ROOMS.values() for place in (*room.places, *room.tests)}
    named |= {*LEFT_OUT, *(name.partition("::")[0] for name in NOT_COUNTED)}
    assert not [place for place in named if not (ROOT / place).exists()]


def test_every_explained_mutant_is_one_of_the_text_as_it_is() -> None:
    keys = list(explained())
    paths = {key.partition(": ")[0] for key in keys}
    there = {
        mutant.key
        for path in paths
        if (ROOT / path).is_file()
        for mutant in mutants(path, rooms.text_of(path))
    }
    assert not [key for key in keys if key not in there]


@pytest.fixture
def house(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A room of two files, of 270 and 30 lines that all can be changed, of which every third is drawn."""
    names = {"generator/linkwise/graphs/long.py": 270, "generator/linkwise/graphs/short.py": 30}
    texts = {name: "".join(f"x{k} = {k} + y\n" for k in range(count)) for name, count in names.items()}
    monkeypatch.setattr(rooms, "sources", lambda: list(texts))
    monkeypatch.setattr(rooms, "text_of", texts.__getitem__)
    monkeypatch.setattr(rooms, "LINES", 3)
    return texts


def test_each_line_has_the_same_chance(house: dict[str, str]) -> None:
    found = drawn("graphs")
    assert len(found) == len({(mutant.path, mutant.line) for mutant in found}) == 100
    assert 80 <= sum("long" in mutant.path for mutant in found) <= 97
    assert 15 <= sum(mutant.line <= 67 for mutant in found if "long" in mutant.path) <= 31


def test_a_line_stays_drawn_when_others_change(house: dict[str, str]) -> None:
    before = {mutant.key for mutant in drawn("graphs")}
    long = next(iter(house))
    house[long] = "z = 1 + y\n" + house[long].replace("x5 = 5 + y\n", "")
    assert len({mutant.key for mutant in drawn("graphs")} & before) >= 99


def test_a_small_room_has_twenty(house: dict[str, str]) -> None:
    for name in house:
        house[name] = "".join(house[name].splitlines(keepends=True)[:25])
    assert len(drawn("graphs")) == 20


def test_each_language_is_changed_by_its_own_words() -> None:
    assert ("in", "not in") in changes("a.py", "x = 1 in y\n")
    assert ("+", "-") in changes("a.py", "x = a // b + c\n")
    page = '// 1 + 1\nfor (const a of b) { if ("x" in y && z === 2) f(g(1)); }\n  draw(a);\n'
    of_page = changes("a.js.j2", page)
    assert {("&&", "||"), ("===", "!=="), ("2", "1"), ("draw(a);", "")} <= of_page
    assert not {("in", "not in"), ("+", "-")} & of_page
    assert changes("a.html.j2", "<p>1 + 1</p>{{ a }}<script>1 + n</script>") == {
        *(("{{ a }}", ""), ("1", "2"), ("+", "-")),
    }
    assert ("NOT ", "") in changes("a.cmake", "if(NOT a)\n  set(b TRUE)\nendif()\n")
    assert ("set(b TRUE)", "") in changes("a.cmake", "if(NOT a)\n  set(b TRUE)\nendif()\n")
    assert ("add(a, b);", "") in changes("a.h", "static int f(int a) {\n  add(a, b);\n}\n")


class Scripted:
    """A tree whose tests end as they are told to: of a changed text, and of the right one."""

    def __init__(self, changed: Sequence[Ended], right: Sequence[Ended] = ()) -> None:
        self.ends = {True: list(changed), False: list(right)}
        self.wrong = False
        self.left: list[tuple[str, ...]] = []

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[None]:
        self.wrong = True
        yield
        self.wrong = False

    def tested(self, tests: Sequence[str], cpu: float, left: Sequence[str] = ()) -> Ended:
        self.left.append(tuple(left))
        return self.ends[self.wrong].pop(0)


BY = "tests/graphs/test_graphs.py::test_names"
FAILS, PASSES = Ended(1, BY), Ended(0)


@pytest.fixture
def decider(tmp_path: Path) -> Decider:
    """One that has a room's three files of tests to ask."""
    made = Decider(Map(tmp_path / "reach"), Record(tmp_path / "survived.json", tmp_path / "caught.json"))
    made.stages = lambda room, mutant: iter([(["a"], 1.0), (["b"], 2.0)])  # type: ignore[method-assign]
    return made


@pytest.mark.parametrize(
    ("tree", "verdict", "told"),
    [
        (Scripted([PASSES, PASSES]), ("survived", "3 s of tests"), None),
        (Scripted([PASSES, FAILS], [PASSES]), ("killed", BY), None),
        (Scripted([Ended(-24)], [PASSES]), ("too slow", "a"), None),
        (Scripted([FAILS, PASSES, PASSES], [FAILS]), ("survived", "3 s of tests"), "fails without a mutant"),
        (Scripted([Ended(1, BY, again=False), PASSES, PASSES]), ("survived", "3 s of tests"), "run again"),
    ],
    ids=["passes", "fails", "too slow", "fails without", "fails once"],
)
def test_a_test_that_fails_by_itself_kills_nothing_and_is_told(
    tree: Any,
    verdict: tuple[str, str],
    told: str | None,
    decider: Decider,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert decider.decide("graphs", some_mutants()[0], tree) == verdict
    said = capsys.readouterr().out
    assert (told in said and BY in tree.left[-1]) if told else said == ""


def test_tests_that_end_badly_without_a_mutant_stop_the_sweep(decider: Decider) -> None:
    with pytest.raises(SystemExit, match="a end with 4 without a mutant, too"):
        decider.decide("graphs", some_mutants()[0], Scripted([Ended(4)], [Ended(4)]))  # type: ignore[arg-type]


def some_mutants() -> list[Mutant]:
    path = "generator/linkwise/escape.py"
    return list(mutants(path, rooms.text_of(path)))


def test_a_verdict_stays_for_the_same_texts_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, other, third = some_mutants()[:3]
    record = Record(tmp_path / "survived.json", tmp_path / "caught.json")
    record.add(one, "killed", BY)
    record.add(other, "survived", "3 s of tests")
    again = Record(tmp_path / "survived.json", tmp_path / "caught.json")
    assert [m and m.verdict for m in map(again.decided, (one, other, third))] == ["killed", "survived", None]
    again.all_tests = "one more test"
    assert again.decided(one)
    assert not again.decided(other)
    for changed in ("digest_of_code", "digest_of_test"):
        with monkeypatch.context() as patch:
            patch.setattr(verdicts, changed, lambda *of: "new")
            assert not again.decided(one)


def test_a_verdict_hangs_on_its_test_and_what_the_file_has_beside_tests(tmp_path: Path) -> None:
    text = "import a\nONE = 1\n\n@mark\ndef test_x():\n    assert ONE\n\ndef test_y():\n    assert a\n"
    file = tmp_path / "test_one.py"

    def found(new: str) -> str:
        file.write_text(new)
        return digest_of_test(file, "test_x")

    own = found(text)
    for same in (("import a", "import b"), ("assert a", "assert not a"), ("import a\n", "import a, c\n\n")):
        assert found(text.replace(*same)) == own, same
    for other in (("ONE = 1", "ONE = 2"), ("assert ONE", "assert not ONE"), ("@mark", "@mark(2)")):
        assert found(text.replace(*other)) != own, other


def test_a_verdict_hangs_on_code_and_not_on_what_is_said_of_it(tmp_path: Path) -> None:
    file = tmp_path / "one.py"
    text = (
        '"""Say."""\n\nA = 1\n"""Is said."""\n\n\n'
        'def f(x):\n    """Say."""\n    return "text" if x else A  # why\n'
    )

    def found(new: str) -> str:
        file.write_text(new)
        return digest_of_code(file)

    own = found(text)
    for same in (("Say", "Tell"), ("Is said", "Is told"), ("# why", "# therefore"), ("\n\n\n", "\n\n\n\n")):
        assert found(text.replace(*same)) == own, same
    for other in (("A = 1", "A = 2"), ('"text"', '"words"'), ("if x", "if not x")):
        assert found(text.replace(*other)) != own, other


def test_what_caught_a_mutant_is_tried_first_once_the_text_is_another_with_a_map_or_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mutant, files = some_mutants()[0], (tmp_path / "survived.json", tmp_path / "caught.json")
    by = "tests/graphs/test_graphs.py::slow"
    monkeypatch.setattr(verdicts, "is_there", lambda test: test == by)
    monkeypatch.setattr(verdicts, "digest_of_test", lambda file, test: "same")
    Record(*files).add(mutant, "killed", f"{by}[one]")
    monkeypatch.setattr(verdicts, "digest_of_code", lambda path: "new")
    reach = Map(tmp_path / "reach")
    decider = Decider(reach, Record(*files))
    assert not decider.record.decided(mutant)
    assert [tests for tests, _ in decider.before(mutant)] == [[by]]
    seconds = {"tests/graphs/test_graphs.py::quick": 1.0, by: 2.0}
    monkeypatch.setattr(reach, "files", {"tests/graphs/test_graphs.py": Reached("", seconds, {}, {})})
    assert list(decider.before(mutant)) == [([by], 2.0)]


def test_a_test_that_is_likely_to_catch_a_mutant_is_tried_first_and_decides_nothing_unless_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mutant, files = some_mutants()[0], (tmp_path / "survived.json", tmp_path / "caught.json")
    likely = "tests/graphs/test_graphs.py::likely"
    path, _, change = mutant.key.partition(": ")
    files[1].write_text(json.dumps({path: {change: f"- - likely: {likely}"}}))
    monkeypatch.setattr(verdicts, "is_there", lambda test: test == likely)
    monkeypatch.setattr(verdicts, "digest_of_test", lambda file, test: "same")
    decider = Decider(Map(tmp_path / "reach"), Record(*files))
    assert decider.record.decided(mutant) is None
    assert [tests for tests, _ in decider.before(mutant)] == [[likely]]
    decider.record.save()
    assert likely in files[1].read_text()
    tree: Any = Scripted([PASSES])
    assert decider.decide("single-files", mutant, tree, "before") is None
    assert likely not in files[1].read_text()


def test_what_passes_at_first_decides_nothing_and_is_not_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mutant, files = some_mutants()[0], (tmp_path / "survived.json", tmp_path / "caught.json")
    quick, slow = (f"tests/graphs/test_graphs.py::{name}" for name in ("quick", "slow"))
    monkeypatch.setattr(verdicts, "is_there", lambda test: True)
    monkeypatch.setattr(verdicts, "digest_of_test", lambda file, test: "same")
    reach = Map(tmp_path / "reach")
    monkeypatch.setattr(reach, "tests", lambda path, line: ([(quick, 20.0), (slow, 50.0)], []))
    first = Decider(reach, Record(*files))
    tree: Any = Scripted([PASSES, PASSES])
    assert first.decide("single-files", mutant, tree, "first") is None
    again = Decider(reach, Record(*files))
    assert again.record.decided(mutant) is None
    assert next(again.stages("single-files", mutant))[0] == [slow]
    monkeypatch.setattr(verdicts, "digest_of_test", lambda file, test: "another")
    assert next(again.stages("single-files", mutant))[0] == [quick]


def test_what_a_mutant_survived_is_not_run_again_on_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mutant, changed = some_mutants()[0], "tests/graphs/test_graphs.py"
    first = Record(tmp_path / "survived.json", tmp_path / "caught.json")
    first.add(mutant, "survived", "3 s of tests")
    monkeypatch.setattr(verdicts, "digest", lambda path: "new" if path == ROOT / changed else digest(path))
    reach = Map(tmp_path / "reach")
    tests = {name: Reached("", {f"{name}::x": 1.0}, {}, {}) for name in (changed, "tests/cli/test_cli.py")}
    monkeypatch.setattr(reach, "files", tests)
    monkeypatch.setattr(reach, "tests", lambda path, line: ([(f"{name}::x", 1.0) for name in tests], []))
    decider = Decider(reach, Record(tmp_path / "survived.json", tmp_path / "caught.json"))
    assert [tests for tests, _ in decider.stages("single-files", mutant)] == [[f"{changed}::x"]]


def test_a_line_has_the_tests_that_reach_it_and_the_rest_of_their_files(
    tmp_path: Path,
) -> None:
    path = "generator/linkwise/extras.py"
    text = rooms.text_of(path)
    line = next(k for k in range(1, text.count("\n")) if name_at(text, k))
    function = name_at(text, line)
    reach = Map(tmp_path)
    reach.files = {
        "tests/a.py": Reached(
            "",
            {"a::slow": 9.0, "a::quick": 1.0, "a::far": 0.1},
            {path: {function: ["a::slow", "a::quick"]}},
            {},
        ),
        "tests/b.py": Reached("", {"b::x": 3.0, "b::y": 2.0}, {path: {function: [""]}}, {}),
        "tests/d.py": Reached(
            "",
            {"d::of_all": 2.0},
            {path: {function: ["d::of_all"]}, "elsewhere/b.py": {f"f{k}": [""] for k in range(9)}},
            {},
        ),
        "tests/c.py": Reached("", {"c::z": 0.1}, {path: {"": [""]}}, {}),
    }

    def near_and_far(line: int) -> list[list[str]]:
        return [[name for name, _ in part] for part in reach.tests(path, line)]

    assert near_and_far(line) == [["a::slow", "a::quick", "b::x", "b::y", "d::of_all"], ["a::far"]]
    at_import = ["a::slow", "a::quick", "a::far", "b::x", "b::y", "d::of_all", "c::z"]
    assert near_and_far(1) == [at_import, []]
    of_line = {path: {text.splitlines()[line - 1].strip(): ["a::slow"]}}
    reach.files["tests/a.py"] = replace(reach.files["tests/a.py"], lines=of_line)
    assert near_and_far(line) == [["a::slow"], ["a::quick", "a::far"]]


def test_tests_of_a_file_stand_together_as_long_as_its_fixtures_pay() -> None:
    tests = [("a::x", 1.0), ("a::y", 1.1), ("a::slow", 60.0), ("b::x", 0.4), ("b::y", 0.4), ("c::x", 3.0)]
    found = in_order(tests, Counter({"c::x": 2}), {"a": 9.0, "b": 0.0})
    assert [name for name, _ in found] == ["b::x", "b::y", "c::x", "a::x", "a::y", "a::slow"]
    assert [seconds for _, seconds in found] == [0.4, 0.4, 3.0, 10.0, 1.1, 60.0]


def test_what_caught_changes_of_the_file_comes_first_then_what_is_quick(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mutant, other = some_mutants()[:2]
    assert mutant.path == other.path
    record, reach = Record(tmp_path / "survived.json", tmp_path / "caught.json"), Map(tmp_path / "reach")
    record.add(other, "killed", "tests/a.py::telling[one]")
    tests = [("tests/a.py::slow", 9.0), ("tests/a.py::telling", 4.0), ("tests/a.py::quick", 1.0)]
    monkeypatch.setattr(reach, "tests", lambda path, line: (tests, []))
    ((ranked, _), *_) = Decider(reach, record).stages("single-files", mutant)
    assert [name.partition("::")[2] for name in ranked] == ["telling", "quick", "slow"]


def test_a_sweep_maps_decides_and_goes_on(tmp_path: Path) -> None:
    for name, text in HOUSE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    for name in ("README.md", "pyproject.toml", "Makefile"):
        (tmp_path / name).write_text("")
    shutil.copytree(ROOT / "tests/mutation", tmp_path / "tests/mutation")

    def swept(*arguments: str, status: int = 1) -> str:
        command = [sys.executable, "-c", SWEEP, "--jobs=1", "--only", "single-files", "runtime", *arguments]
        environment = {"PYTHONPATH": str(tmp_path / "tests"), "PATH": "/usr/bin:/bin"}
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == status, done.stderr
        return done.stdout + done.stderr

    assert "mapped" not in swept("--minutes=0")
    assert swept("--write").endswith("5 mutants are not decided yet: run `make mutate` before --write\n")
    said = swept()
    assert "mapped: tests/test_one.py" in said
    assert "no verdict by tests/test_one.py::test_fails_now_and_then: failed, and passed" in said
    kept = Record(tmp_path / "out/mutate/survived.json", tmp_path / "tests/mutation/caught.json").verdicts
    by = {key.partition(" [")[0].rpartition(": ")[2]: (one.verdict, one.by) for key, one in kept.items()}
    assert by["return a + 1"] == ("killed", "tests/test_one.py::test_program")
    assert by["return a - 2"] == ("killed", "tests/test_one.py::test_copy")
    assert by["return a * 3"][0] == "survived"
    assert by["FIRST = steps[0]"] == ("killed", "tests/test_imports.py")
    assert "| single-files | 4 | 2 | 0 | 50.0 % |" in said
    assert "0 of 0 mutants decided" in swept()
    assert swept("--write", status=0) == ""
    page = (tmp_path / "docs/trust.md").read_text()
    assert page.startswith(f"before\n{MARK}{HEAD}| cli | 0 | – | 0 | – |\n")
    assert "| single-files | 4 | 2 | 0 | 50.0 % |\n" in page
    assert page.endswith(f"{END}after\n")
