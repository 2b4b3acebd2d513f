"""Subjects of a study: mass and height of each, as a table of the study has them."""

import csv
import math
from dataclasses import dataclass

from linkwise.analysis.logs.checks import named_once
from linkwise.errors import LinkwiseError, within
from linkwise.study.paths import opened_here

LIMITS = {"mass": (0.01, 1e4, "kg"), "height": (0.2, 3.0, "m")}
"""Least and largest value that is taken, and the unit: a height of 175 is in cm."""


@dataclass(frozen=True)
class SubjectSize:
    """Mass of a person in kg and height in m; NaN where it is not told."""

    mass: float = math.nan
    height: float = math.nan


def read_subjects(table: str) -> dict[str, SubjectSize]:
    """Return mass and height by subject from a CSV file of subject, mass and height, either of them or both.

    Raises LinkwiseError, with the row, for an invalid one.
    """
    found: dict[str, SubjectSize] = {}
    with opened_here(table) as path, path.open(newline="", encoding="utf-8-sig") as file, within(table):
        try:
            reader = csv.DictReader(file)
            names = named_once(reader.fieldnames or ())
            if "subject" not in names or not {"mass", "height"} & set(names):
                raise LinkwiseError("name its columns subject, mass in kg and height in m")
            for number, row in enumerate(reader, 2):
                with within(f"row {number}"):
                    subject = (row["subject"] or "").strip()
                    if not subject or subject in found:
                        raise LinkwiseError(
                            f"subject {subject!r} is there twice" if subject else "the subject is missing"
                        )
                    found[subject] = SubjectSize(
                        **{name: _number(name, row[name]) for name in LIMITS if name in names}
                    )
        except (UnicodeDecodeError, csv.Error) as error:
            raise LinkwiseError(f"not a table of text in UTF-8: {error}") from error
    return found


def _number(name: str, text: str | None) -> float:
    """Return a mass or a height, NaN where the cell is empty."""
    least, most, unit = LIMITS[name]
    if not (text or "").strip():
        return math.nan
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise LinkwiseError(f"{name} is {text!r}; give {unit}, {least:g} to {most:g}")
    return value
