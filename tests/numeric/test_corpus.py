"""Eight real robots against Pinocchio; `make corpus` runs all of them."""

from typing import Any

import pytest

pytest.importorskip("pinocchio")

from tools.corpus import ROBOTS, study
from tools.corpus_report import LIMIT

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

ROBOT: dict[str, tuple[dict[str, Any], dict[str, int]]] = {
    "kinova": ({}, {"joints": 6, "links": 6, "merged": 6}),
    "panda": ({}, {"joints": 8, "links": 9, "mimic": 1}),
    "solo12": ({}, {"joints": 12, "links": 12, "merged": 5}),
    "allegro_left_hand": ({"allow_unphysical": True}, {"joints": 16, "links": 16}),
    "human": ({"base": "floating"}, {"joints": 42, "links": 18, "massless": 19}),
    "iris_simple": ({"base": "floating"}, {"joints": 6, "links": 1}),
    "simple_humanoid_classical": ({}, {"joints": 29, "links": 29}),
    "romeo": ({"allow_unphysical": True}, {"joints": 33, "links": 31, "mimic": 22}),
}


@pytest.mark.parametrize("name", ROBOT)
def test_real_robots_torques_are_pinocchios(name: str) -> None:
    options, expected = ROBOT[name]
    row = study(next(ROBOTS.rglob(f"{name}.urdf")), options, samples=20)
    assert "refused" not in row, row
    assert {key: row[key] for key in expected} == expected
    assert row["error_sum"] <= LIMIT
    assert row["error_link"] <= LIMIT


REFUSED = {
    "ur3": "<robot> is empty: the file has no <link>",
    "romeo": "joint 'LHand' moves no mass at all",
    "iris_simple": "no joint moves; give one a moving type, or let the base move with --base floating",
    "go1": "link 'base' has an inertia that breaks the triangle inequality (3e-06 > 0 + 0 kg·m²)",
}


@pytest.mark.parametrize("name", REFUSED)
def test_defect_of_a_real_file_is_named(name: str) -> None:
    row = study(next(ROBOTS.rglob(f"{name}.urdf")), {}, samples=1)
    assert REFUSED[name] in row["refused"]
