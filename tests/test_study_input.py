"""Studies that cannot be: each is told in a line before any work begins."""

import os
from pathlib import Path

import pytest
from linkwise import LinkwiseError
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.study import run_study
from linkwise.study.column_patterns import fitting
from linkwise.study.path_fields import FieldedPath
from studies import CHOICES, HEAD, QUICK, TRIALS, Here, write_study

BAD: dict[str, tuple[tuple[str, ...], str]] = {
    "unknown key": ((HEAD, "speed = 1\n", TRIALS), "the file has the unknown key 'speed'; known are "),
    "unknown choice": (
        (HEAD, "[analysis]\ncut = 6\n", TRIALS),
        "[analysis] has the unknown key 'cut'; known are ",
    ),
    "wrong type": (
        (HEAD, "[analysis]\ncutoff = '6'\n", TRIALS),
        "[analysis]: 'cutoff' is '6'; give a number",
    ),
    "impossible choice": (
        (HEAD, "[analysis]\ncutoff = -6\n", TRIALS),
        "--cutoff -6: give a frequency in Hz above 0",
    ),
    "one name": ((HEAD, TRIALS.replace("-{trial}", "")), "two trials are called 'S1-fast'; name each"),
    "no log": (
        (HEAD, '[[trial]]\nname = "a"\nlog = "gone.csv"\nrobot = "planar3"\ncondition = "x"\n'),
        "gone.csv: no such file",
    ),
    "no pattern": (
        (HEAD, TRIALS.replace(".csv", ".mot")),
        "no log is called data/{subject}/{condition}_{trial}.mot",
    ),
    "two ways": (
        (HEAD, TRIALS.replace("{condition}_{trial}", "{condition}{trial}")),
        "fits the pattern in two ways, subject=S1, condition=f, trial=ast_1 and "
        "subject=S1, condition=fast_, trial=1; put folders",
    ),
    "no robot": ((HEAD, TRIALS.replace("planar3", "gone.urdf")), "gone.urdf: no such file"),
    "no factor": ((HEAD.replace("condition", "speed"), TRIALS), "needs 'speed', one of the study's factors"),
    "no column": (
        (HEAD, 'columns = ["tua/*"]\n', CHOICES, TRIALS),
        "'columns' has 'tua/*', which no column is called; nearest are 'tau/",
    ),
    "no figure": (
        (HEAD, CHOICES, '[[figure]]\ncolumns = ["tau_gravity/**", "tau_qd/**"]\n', TRIALS),
        "[[figure]]: 20 columns; 12 are legible, so give fewer",
    ),
    "no payload": (
        (HEAD, CHOICES, 'payload = ["x"]\n', TRIALS),
        "trial 'S1-fast-1': --payload x: ",
    ),
    "no limits": (
        (HEAD, '[cycles]\nduring = "stands"\nshortest = 2.0\nlongest = 1.0\n', TRIALS),
        "[cycles]: 'shortest' is 2 and 'longest' 1; give seconds",
    ),
    "a column's name": (
        (HEAD.replace("condition", "Time"), TRIALS),
        "factor 'Time' has a name that is taken",
    ),
    "names that differ in case alone": (
        (HEAD.replace('["condition"]', '["Speed", "speed"]'), TRIALS),
        "factor 'Speed' has a name that is taken",
    ),
    "no level": (
        (HEAD, '[[compare]]\nfactor = "condition"\nbetween = ["slow", "mad"]\ncolumns = ["tau/*"]\n', TRIALS),
        "no trial has the condition 'mad'; there are 'fast', 'slow'",
    ),
    **{
        f"{told} to compare": (
            (HEAD, f'[[compare]]\nfactor = "condition"\nbetween = {levels}\ncolumns = ["tau/*"]\n', TRIALS),
            f"[[compare]]: 'between' is {levels}; give two levels",
        )
        for told, levels in {
            "one level": ["slow"],
            "three levels": ["slow", "fast", "mad"],
            "a level twice": ["slow", "slow"],
        }.items()
    },
    "another robot": (
        (
            HEAD,
            TRIALS,
            '[[trial]]\nname = "a"\nlog = "data/S1/slow_1.csv"\nrobot = "puma560"\ncondition = "x"\n',
        ),
        "robot puma560 is another one than planar3: they differ in the joints ",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_is_told_in_a_line_before_any_work(case: str, tmp_path: Path) -> None:
    parts, message = BAD[case]
    file, engine = write_study(tmp_path, *parts, trials=1 if case != "one name" else 2), Here()
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, tmp_path / "out", engine)
    assert str(caught.value).startswith(f"{file}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert (engine.given, (tmp_path / "out").exists()) == ([], False)


def test_a_folder_that_cannot_be_is_refused_before_any_work(tmp_path: Path) -> None:
    file, engine = write_study(tmp_path, HEAD, TRIALS, subjects=1, trials=1), Here()
    (tmp_path / "file").touch()
    with pytest.raises(LinkwiseError, match="nothing was written"):
        run_study(file, tmp_path / "file/out", engine)
    assert engine.given == []


def test_a_folder_of_something_else_stays(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, TRIALS, subjects=1, trials=1)
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine.txt").touch()
    with pytest.raises(LinkwiseError, match="exists and is not a former study"):
        run_study(file, tmp_path / "out", Here())


DAMAGED = {
    "no state": ('"state": "done"', '"state": 5', "state is not 'begun' or 'done'"),
    "no name": ('"files": [', '"files": ["..", ', "'..' among 'files' is not a file's name"),
    "cut": ('"state"', "", "Expecting property name"),
    "deep": ('"done"', "[" * 100_000, "nested too deeply"),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_a_damaged_mark_of_a_study_is_told_and_what_is_there_stays(case: str, tmp_path: Path) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    right, wrong, reason = DAMAGED[case]
    mark = out / "study.json"
    mark.write_text(mark.read_text().replace(right, wrong))
    before = sorted(out.rglob("*"))
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, out, Here())
    assert str(caught.value).startswith(f"{mark} is damaged: {reason}")
    assert str(caught.value).endswith("; give another --out")
    assert sorted(out.rglob("*")) == before


def test_a_damaged_record_of_a_trial_has_it_done_again(tmp_path: Path) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    (out / "trials/S1-fast-1/_record.json").write_text("[" * 100_000)
    assert run_study(file, out, Here()).fresh == 1


def put_instead(path: Path, kind: str) -> None:
    """Something that is no regular file in the place of one."""
    path.unlink()
    if kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a directory":
        path.mkdir()
    else:
        path.symlink_to({"a device": "/dev/zero", "no such file": "nowhere"}[kind])


def refusal(file: Path, out: Path) -> str:
    """For what a study is refused, told within bounds of time and memory."""

    def told() -> str:
        with pytest.raises(LinkwiseError) as caught:
            run_study(file, out, Here())
        return str(caught.value)

    return in_own_process(told, ProcessLimits(seconds=5, memory=1 << 30))


@pytest.mark.parametrize("kind", ["a pipe", "a directory", "a device", "no such file"])
def test_what_is_no_file_in_the_place_of_the_lock_is_told_and_not_waited_for(
    kind: str, tmp_path: Path
) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    put_instead(out / ".lock", kind)
    assert refusal(file, out).startswith(f"{out / '.lock'}: {'' if 'such' in kind else 'this is '}{kind}")
    assert not (tmp_path / "out/nowhere").exists()


@pytest.mark.parametrize("kind", ["a pipe", "a directory", "a device"])
def test_what_is_no_file_in_the_place_of_a_record_is_told_and_not_read(kind: str, tmp_path: Path) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    record = out / "trials/S1-fast-1/_record.json"
    put_instead(record, kind)
    refused = refusal(file, out)
    assert refused.startswith(f"{record.absolute()}: this is {kind}")
    assert refused.endswith("; give another --out, or remove it")


@pytest.mark.parametrize("name", ["study.json", "trials/S1-fast-1/_record.json"])
def test_a_file_far_larger_than_a_study_writes_is_not_read(name: str, tmp_path: Path) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    os.truncate(out / name, 1 << 35)  # sparse
    assert refusal(file, out).startswith(f"{out / name}: the file is larger than 64 MiB")


@pytest.mark.parametrize("kind", ["a pipe", "a device", "no such file"])
def test_a_trial_whose_files_are_none_any_more_is_done_again(kind: str, tmp_path: Path) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    put_instead(out / "trials/S1-fast-1/_summary.npz", kind)
    assert run_study(file, out, Here()).fresh == 1


def test_a_trial_whose_numbers_are_damaged_is_told(tmp_path: Path) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    numbers = out / "trials/S1-fast-1/_summary.npz"
    numbers.write_bytes(bytes(numbers.stat().st_size))
    (out / "study.html").unlink()  # tables are made again
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, out, Here())
    assert str(caught.value).startswith(f"{numbers}: not a trial's file of arrays, or damaged (")
    assert str(caught.value).endswith("; remove its folder")


def test_a_folder_of_another_study_stays(tmp_path: Path) -> None:
    file, other = write_study(tmp_path, HEAD, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "other.toml"
    run_study(file, tmp_path / "out", Here())
    other.write_text(file.read_text().replace('name = "arms"', 'name = "legs"'))
    with pytest.raises(LinkwiseError, match="is of the study 'arms', whose trials would go"):
        run_study(other, tmp_path / "out", Here())
    assert len(list((tmp_path / "out/trials").iterdir())) == 2


NAMES = ["tau/knee", "tau/knee/foot", "q/knee", "a" * 60, "a/" * 30]


@pytest.mark.parametrize(
    ("pattern", "fits"),
    [
        ("tau/*", NAMES[:1]),
        ("tau/**", NAMES[:2]),
        ("*/k*e", [NAMES[0], NAMES[2]]),
        ("**o*t", NAMES[1:2]),
        ("***/knee", [NAMES[0], NAMES[2]]),
        ("*a" * 30, NAMES[3:4]),
        ("**a" * 30 + "*", NAMES[3:4]),
        ("*a**" * 25 + "b", None),
        ("**" * 400_000, NAMES),
        ("*a" * 400_000, None),
    ],
)
def test_columns_that_a_pattern_fits_are_found_at_once(pattern: str, fits: list[str] | None) -> None:
    def found() -> list[str]:
        return fitting("'columns'", NAMES, [pattern])

    limits = ProcessLimits(seconds=2, memory=1 << 28)
    if fits is not None:
        assert in_own_process(found, limits) == fits
        return
    with pytest.raises(LinkwiseError, match=r"'columns' has '.*', which no column is called; nearest are"):
        in_own_process(found, limits)


A, MANY = "a" * 200, [f"f{number}" for number in range(200)]
FITS: list[tuple[str, str, dict[str, str] | str]] = [
    ("logs/{s}/{c}_{k}.csv", "logs/S1/slow_2.csv", {"s": "S1", "c": "slow", "k": "2"}),
    ("logs/{s}/{c}_{k}.csv", "logs/S1/part/slow_2.csv", {}),
    ("logs/{s}/{c}_{k}.csv", "logs/S1/_2.csv", {}),
    ("logs/{s}/{s}_{k}.csv", "logs/S1/S1_2.csv", {"s": "S1", "k": "2"}),
    ("logs/{s}/{s}_{k}.csv", "logs/S1/S2_2.csv", {}),
    ("{a}{b}.csv", "xy.csv", {"a": "x", "b": "y"}),
    ("{a}{b}.csv", "xyz.csv", "in two ways, a=x, b=yz and a=xy, b=z; put folders"),
    ("{a}_{b}_{a}", "x_y_z_x_y", {"a": "x_y", "b": "z"}),
    ("{a}{b}{c}{d}{e}{f}{g}x{h}.csv", f"x{A}.csv", {}),
    ("".join(f"{{{name}}}" for name in MANY) + ".csv", f"{A}.csv", dict.fromkeys(MANY, "a")),
    ("{a}{b}{c}{d}{a}{b}{c}{d}_{a}x", f"{A}_b{A}x", "in too many ways to try them; put folders"),
]


@pytest.mark.parametrize(("pattern", "path", "expected"), FITS, ids=map(str, range(len(FITS))))
def test_fields_of_a_path_are_found_or_refused_at_once(
    pattern: str, path: str, expected: dict[str, str] | str
) -> None:
    def found() -> dict[str, str]:
        return FieldedPath(pattern).fields_of(path)

    limits = ProcessLimits(seconds=2, memory=1 << 28)
    if isinstance(expected, dict):
        assert in_own_process(found, limits) == expected
        return
    with pytest.raises(LinkwiseError, match=expected):
        in_own_process(found, limits)
