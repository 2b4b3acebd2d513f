"""Patterns of a study's file: of the columns that are kept, and of the paths of logs."""

import pytest
from linkwise import LinkwiseError
from linkwise.analysis.column_patterns import fitting
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.study.patterns import FieldedPath

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
