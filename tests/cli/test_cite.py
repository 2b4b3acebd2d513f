"""References of a result: of exactly the methods that it used."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from helpers.command_line import run_linkwise
from linkwise.citations import Citation, citations, record_of
from linkwise.errors import LinkwiseError

ALWAYS = ["linkwise", "gunji2025"]


def keys(record: dict[str, Any]) -> list[str]:
    return [one.key for one in citations(record)]


@pytest.mark.parametrize(
    ("record", "more"),
    [
        ({}, []),
        ({"processing": {"derivative": "five-point"}, "residuals": {"of": []}, "uncertain": {}}, []),
        ({"processing": {"derivative": "savitzky-golay"}}, ["savitzky1964"]),
        ({"markers": {"rms": 0.01}, "left_by_muscles": [{}]}, ["seth2018"]),
        (
            {"methods": {"derivatives": ["five-point", "savitzky-golay"], "muscles": True, "markers": False}},
            ["savitzky1964", "seth2018"],
        ),
        ({"methods": {"derivatives": ["five-point"], "muscles": False, "markers": False}}, []),
        ({"residuals": {"of": [{}], "largest_net_external_force_N": None}}, []),
        ({"residuals": {"of": [{}], "largest_net_external_force_N": 800.0}}, ["hicks2015"]),
        ({"uncertain": {"presets": {"zatsiorsky-men": {}}, "motion": None}}, ["zatsiorsky2002"]),
        ({"uncertain": {"motion": {"angle": 1}}, "columns": [{"name": "sd/tau/hip"}]}, ["norgaard2000"]),
        (
            {"uncertain": {"motion": {"angle": 1}}, "columns": [{"name": "sd/power/hip"}]},
            ["norgaard2000", "goodman1960"],
        ),
        (
            {
                "uncertain": {"assumed": [{"motion": {"angle": 1}}, {"motion": {}}]},
                "columns": [{"column": "sd-motion/tau_qd/hip/foot/knee"}],
            },
            ["norgaard2000", "goodman1960"],
        ),
        ({"tests": [{"threshold": float("nan"), "correction": "none"}]}, ["hedges1981"]),
        (
            {"tests": [{"threshold": 3.1, "correction": "holm"}, {"threshold": 3.1, "correction": "fdr-bh"}]},
            ["pataky2012", "hedges1981", "holm1979", "benjamini1995"],
        ),
    ],
)
def test_a_result_has_the_references_of_what_it_used(record: dict[str, Any], more: list[str]) -> None:
    assert keys(record) == ALWAYS + more


def test_the_command_prints_bibtex(tmp_path: Path) -> None:
    (tmp_path / "analysis.json").write_text(json.dumps({"processing": {"derivative": "savitzky-golay"}}))
    done = run_linkwise("cite", tmp_path, folder=tmp_path)
    assert re.findall(r"^@(\w+)\{(\w+),$", done.stdout, re.MULTILINE) == [
        ("software", "linkwise"),
        ("article", "gunji2025"),
        ("article", "savitzky1964"),
    ]
    assert "% derivatives of the motion\n@article{savitzky1964," in done.stdout
    assert done.stdout.count("{") == done.stdout.count("}")


def test_without_a_result_it_says_how_linkwise_is_cited(tmp_path: Path) -> None:
    done = run_linkwise("cite", folder=tmp_path)
    assert re.findall(r"^@\w+\{(\w+),$", done.stdout, re.MULTILINE) == ALWAYS


def test_an_entry_has_its_fields_and_why_it_is_there() -> None:
    made = Citation("k", "book", {"title": "T"}, "because").bibtex
    assert made == "% because\n@book{k,\n  title = {T},\n}"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, "holds none of"),
        ("[]", "is damaged"),
        ("{", "is damaged"),
        ('{"methods": 3}', "is damaged"),
        ('{"tests": [{"threshold": 1}]}', "is damaged"),
        ('{"uncertain": 3}', "is damaged"),
    ],
)
def test_what_is_no_result_is_refused(tmp_path: Path, text: str | None, told: str) -> None:
    if text is not None:
        (tmp_path / "analysis.json").write_text(text)
    with pytest.raises(LinkwiseError, match=told):
        record_of(tmp_path)


def test_a_damaged_table_of_a_study_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text("{}")
    (tmp_path / "tests.parquet").write_bytes(b"PAR1")
    with pytest.raises(LinkwiseError, match=r"study\.json: is damaged"):
        record_of(tmp_path)


def test_a_record_may_be_given_itself_and_other_files_are_told(tmp_path: Path) -> None:
    record = tmp_path / "analysis.json"
    record.write_text('{"markers": {}}')
    assert record_of(record) == record_of(tmp_path) == (record, {"markers": {}})
    record.rename(tmp_path / "identified.json")
    for given in (tmp_path, tmp_path / "identified.json"):
        with pytest.raises(LinkwiseError, match=r": identify wrote this, and cite knows the methods of anal"):
            record_of(given)
    with pytest.raises(LinkwiseError, match=r"lost: no such file or folder; give a folder that analyze"):
        record_of(tmp_path / "lost")
