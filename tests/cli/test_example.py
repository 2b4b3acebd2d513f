"""`linkwise example`: whole cases, unchanged, into folders that they may take."""

import re
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest
from helpers.command_line import run_linkwise
from linkwise.errors import LinkwiseError
from linkwise.example_cases import example_case, example_cases, write_case

CASES = Path(__file__).parents[2] / "examples/cases"
NAMES = ["arm-log", "leg", "throw", "walk"]


def published() -> dict[str, str]:
    """Return the SHA-256 of each file of the cases, as the table has them."""
    lines = (CASES / "SHA256SUMS").read_text().splitlines()
    return {path: digest for digest, path in (line.split("  ") for line in lines)}


def refused(folder: Path, *words: str) -> str:
    ended = run_linkwise("example", *words, folder=folder)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.count("\n") == 1
    return ended.stderr


def test_the_table_has_every_file_of_every_case_and_its_hash() -> None:
    there = {
        path.relative_to(CASES).as_posix(): path for path in CASES.glob("*/*.*") if path.suffix != ".pyc"
    }
    assert {path: sha256(file.read_bytes()).hexdigest() for path, file in there.items()} == published()
    for name in NAMES:
        assert {f"{name}/README.md", f"{name}/SOURCE.md"} <= set(there)
        assert re.search(r"(?i)licen[cs]e", (CASES / name / "SOURCE.md").read_text())


def test_without_a_name_all_are_listed_with_what_they_are(tmp_path: Path) -> None:
    ended = run_linkwise("example", folder=tmp_path)
    assert ended.returncode == 0
    assert [line.split()[0] for line in ended.stdout.splitlines()[:4]] == NAMES == list(example_cases())
    assert "walk     A person walks on a treadmill with force plates" in ended.stdout
    assert ended.stdout.endswith("\n\nlinkwise example NAME puts one into a folder of that name\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", NAMES)
def test_a_case_is_written_as_it_was_published_and_says_what_to_type(name: str, tmp_path: Path) -> None:
    ended = run_linkwise("example", name, "--out", "a place", folder=tmp_path)
    assert ended.returncode == 0, ended.stderr
    written = {f"{name}/{file.name}": file for file in (tmp_path / "a place").iterdir()}
    hashes = {path: sha256(file.read_bytes()).hexdigest() for path, file in written.items()}
    assert hashes == {path: digest for path, digest in published().items() if path.startswith(f"{name}/")}
    first, *more = re.search(r"```sh\n(.*?)```", (CASES / name / "README.md").read_text(), re.DOTALL)[
        1
    ].splitlines()  # type: ignore[index]
    typed = ended.stdout.splitlines()[-2 - len(more) :]
    assert typed == ["  cd 'a place'", f"  {first}", *(f"  {line}" for line in more)]
    assert first.startswith("linkwise ")


def test_a_second_time_nothing_is_written_and_results_beside_it_stay(tmp_path: Path) -> None:
    run_linkwise("example", "throw", folder=tmp_path)
    times = {file: file.stat().st_mtime_ns for file in (tmp_path / "throw").iterdir()}
    (tmp_path / "throw/result").mkdir()
    ended = run_linkwise("example", "throw", folder=tmp_path)
    assert ended.stdout.startswith("up to date: throw: 6 files\n")
    assert {file: file.stat().st_mtime_ns for file in times} == times
    assert (tmp_path / "throw/result").is_dir()


def test_what_is_there_and_not_the_case_is_refused_by_name_and_stays(tmp_path: Path) -> None:
    assert refused(tmp_path, "wlak") == (
        "linkwise: error: there is no example 'wlak'; give one of arm-log, leg, throw, walk\n"
    )
    (tmp_path / "own").mkdir()
    (tmp_path / "own/notes.txt").write_text("mine")
    assert "own is not empty; give another --out" in refused(tmp_path, "throw", "--out", "own")
    assert [file.name for file in (tmp_path / "own").iterdir()] == ["notes.txt"]
    assert "notes.txt is not a folder; give another --out" in refused(
        tmp_path, "throw", "--out", "own/notes.txt"
    )
    (tmp_path / "own/README.md").write_text("mine too")
    assert "own is not empty; give another --out" in refused(tmp_path, "throw", "--out", "own")
    run_linkwise("example", "throw", folder=tmp_path)
    assert "throw holds the example throw; give another --out" in refused(tmp_path, "leg", "--out", "throw")
    (tmp_path / "throw/arm.urdf").write_text("<robot/>")
    told = refused(tmp_path, "throw")
    assert "throw holds this example, but arm.urdf was changed; move it away, or give another --out" in told
    assert (tmp_path / "throw/arm.urdf").read_text() == "<robot/>"
    (tmp_path / "link").symlink_to(tmp_path / "throw")
    assert "link is a symbolic link; give another --out" in refused(tmp_path, "walk", "--out", "link")


def test_a_file_that_is_not_the_published_one_is_never_handed_out(tmp_path: Path) -> None:
    case = example_case("throw")
    spoilt = replace(case, files={**case.files, "throw.csv": "0" * 64})
    with pytest.raises(LinkwiseError, match=r"^example throw: throw\.csv is not what was published; install"):
        write_case(spoilt, tmp_path / "throw")
    lost = replace(case, files={**case.files, "gone.csv": "0" * 64})
    with pytest.raises(
        LinkwiseError, match=r"^example throw: cannot read gone\.csv: .*; install linkwise again"
    ):
        write_case(lost, tmp_path / "throw")
    assert not list(tmp_path.iterdir())


def test_a_folder_needs_a_name_and_is_typed_so_that_cd_takes_it(tmp_path: Path) -> None:
    assert "--out place is the folder of one case; name it: arm-log, leg" in refused(
        tmp_path, "--out", "place"
    )
    ended = run_linkwise("example", "throw", "--out=-x", folder=tmp_path)
    assert "  cd ./-x\n" in ended.stdout
    assert (tmp_path / "-x/README.md").is_file()
