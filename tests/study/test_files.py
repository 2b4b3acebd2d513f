"""A trial is done again when any file that it is made of changes: of a log that is a folder, each in it."""

from pathlib import Path

import pytest
from linkwise.analysis.choices import AnalysisChoices
from linkwise.study.inputs import trial_key
from linkwise.study.plan import StudyPlan, Trial


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A log of two files, one deeper."""
    (tmp_path / "bag/part").mkdir(parents=True)
    (tmp_path / "bag/metadata.yaml").write_text("one")
    (tmp_path / "bag/part/0.db3").write_text("two")
    return tmp_path / "bag"


def test_each_file_of_a_folder_counts(bag: Path) -> None:
    plan = StudyPlan("arms", bag.parent / "study.toml", ("subject",), (), pages=False, trust_python=False)
    trial = Trial("a", (("subject", "S1"),), str(bag), "planar3", AnalysisChoices())
    key, files = trial_key(plan, trial, {})
    assert list(files) == [str(bag / "metadata.yaml"), str(bag / "part/0.db3")]
    assert trial_key(plan, trial, files).key == key
    (bag / "part/0.db3").write_text("three")
    changed = trial_key(plan, trial, files).key
    (bag / "part/1.db3").write_text("")
    assert len({key, changed, trial_key(plan, trial, files).key}) == 3


def test_how_a_file_is_read_counts_and_what_else_it_is_called_does_not(tmp_path: Path) -> None:
    plan = StudyPlan("arms", tmp_path / "study.toml", ("subject",), (), pages=False, trust_python=False)
    keys = []
    for name in ("a.csv", "b.csv", "a.mot"):
        (tmp_path / name).write_text("time")
        trial = Trial("a", (("subject", "S1"),), str(tmp_path / name), "planar3", AnalysisChoices())
        keys.append(trial_key(plan, trial, {}).key)
    assert keys[0] == keys[1] != keys[2]
