"""Studies that cannot be: each is told in a line before any work begins."""

import json
import os
from pathlib import Path

import pytest
from helpers.studies import CHOICES, HEAD, QUICK, TRIALS, Here, write_study
from linkwise import LinkwiseError
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.study import run_study

COMPARE = '[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau/*"]\n'
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
    "wrong type in a list": ((HEAD, "columns = ['*', 3]\n", TRIALS), "'columns'[1] is 3; give a text"),
    "wrong type in a table": (
        (HEAD, "[robot]\nlock = {joint1 = 'x'}\n", TRIALS),
        "[robot]: 'lock'.joint1 is 'x'; give a number",
    ),
    "no list": ((HEAD, "[analysis]\npayload = 3\n", TRIALS), "[analysis]: 'payload' is 3; give a list"),
    "no table": ((HEAD, "[robot]\nlock = [3]\n", TRIALS), "[robot]: 'lock' is [3]; give a table"),
    "no flag": ((HEAD, "pages = 1\n", TRIALS), "'pages' is 1; give true or false"),
    "no whole number": ((HEAD, "[analysis]\nwindow = 3.5\n", TRIALS), "'window' is 3.5; give a whole number"),
    "none of the choices": (
        (HEAD, '[[figure]]\ncolumns = "tau/*"\nband = "wide"\n', TRIALS),
        "[[figure]]: 'band' is 'wide'; give 'deviation' or 'range' or 'none'",
    ),
    "a number too large for a float": (
        (HEAD, f"[analysis]\ncutoff = {'9' * 400}\n", TRIALS),
        f"[analysis]: 'cutoff' is {'9' * 40}…{'9' * 39}; give a number",
    ),
    "nothing of what is needed": (
        (HEAD, '[[figure]]\nband = "range"\n', TRIALS),
        "[[figure]] needs 'columns'",
    ),
    "impossible choice": (
        (HEAD, "[analysis]\ncutoff = -6\n", TRIALS),
        "[analysis] cutoff -6: give a frequency in Hz above 0",
    ),
    "one name": ((HEAD, TRIALS.replace("-{trial}", "")), "two trials are called 'S1-fast'; name each"),
    "no log": (
        (HEAD, '[[trial]]\nname = "a"\nlog = "gone.csv"\nrobot = "planar3"\ncondition = "x"\n'),
        "gone.csv: no such file",
    ),
    "empty trial": ((HEAD, "[[trial]]\n"), "trial 1: needs 'log'"),
    "a choice of one trial": (
        (HEAD, CHOICES, TRIALS + "padding = 'even'\n"),
        "[analysis] filter_order and [analysis] padding go with [analysis] cutoff; add it",
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
        "trial 'S1-fast-1': [analysis] payload x: ",
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
    "no columns to compare": (
        (HEAD, '[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = []\n', TRIALS),
        "[[compare]]: 'columns' is empty; name one or more",
    ),
    "subjects who are not others": (
        (HEAD, f"{COMPARE}paired = false\n", TRIALS),
        "[[compare]] condition: 'paired' is false, and 'slow' and 'fast' have subjects in common, 'S1', 'S2'",
    ),
    "a family without a correction": (
        (HEAD, f'{COMPARE}family = "a"\n', TRIALS),
        "[[compare]]: the family 'a' is not corrected; add 'correct'",
    ),
    "a family corrected in two ways": (
        (
            HEAD,
            f'{COMPARE}family = "a"\ncorrect = "holm"\n',
            f'{COMPARE}family = "a"\ncorrect = "fdr-bh"\n',
            TRIALS,
        ),
        "[[compare]]: the family 'a' has 'correct' 'holm' at 'alpha' 0.05, and 'fdr-bh' at 0.05",
    ),
    "no correction": (
        (HEAD, f'{COMPARE}correct = "sidak"\n', TRIALS),
        "[[compare]]: 'correct' is 'sidak'; give 'none' or 'bonferroni' or 'holm' or 'fdr-bh'",
    ),
    "a factor that sides make": (
        (
            HEAD.replace("condition", "side"),
            '[cycles]\nstart = { right = "a>1", left = "b>1" }\n',
            TRIALS.replace("{condition}", "{side}"),
        ),
        "the factor 'side' is made by [cycles]",
    ),
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
    "no name": ('"files": [', '"files": ["..", ', "'..' among 'files' is not a name of a study's file"),
    "not a file of a study": (
        '"files": [',
        '"files": ["trials", ',
        "'trials' among 'files' is not a name of a study's file",
    ),
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


@pytest.mark.parametrize(
    ("entry", "value"),
    [("samples", "many"), ("cycles", None), ("rate", "fast"), ("warnings", "none"), ("outputs", [])],
)
def test_a_record_whose_entries_are_of_other_types_has_the_trial_done_again(
    entry: str, value: object, tmp_path: Path
) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    record = out / "trials/S1-fast-1/_record.json"
    record.write_text(json.dumps(json.loads(record.read_text()) | {entry: value}))
    assert run_study(file, out, Here()).fresh == 1
    assert run_study(file, out, Here()).fresh == 0


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
    """Return why a study is refused, told within bounds of time and memory."""

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


@pytest.mark.parametrize("name", ["summary.parquet", "tests.parquet"])
def test_a_folder_in_the_place_of_a_studys_file_is_told_before_any_work(name: str, tmp_path: Path) -> None:
    """The folder is one that is made again, or one that a former run made and would now be removed."""
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), tmp_path / "out"
    run_study(file, out, Here())
    mark = json.loads((out / "study.json").read_text())
    (out / "study.json").write_text(json.dumps(mark | {"files": [*mark["files"], name], "key": ""}))
    (out / name).unlink(missing_ok=True)
    (out / name).mkdir()
    refused = refusal(file, out)
    assert refused.startswith(f"{out / name}: this is a directory; give another --out")


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
