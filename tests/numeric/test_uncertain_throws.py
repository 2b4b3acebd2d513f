"""Bands of 90 % against throws whose truth is known: how often truth lies in them.

A throw is an instant of one long log, half a second of motion about it: the arm that threw has bodies of its
own there, drawn about those of the robot that is analysed, and positions and loads are measured with noise.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.motion_logs import PLANAR3, write_csv
from linkwise import Load, Lowpass, Processing
from linkwise.analysis import analyze
from linkwise.package.load import import_package

from numeric.draws import drawn_bodies, load_torque

THROWS, APART, RATE = 2000, 20, 100.0
HALF_BAND = 1.6449
"""Deviations within which 90 % of normal errors lie."""
NOISE = np.array([2e-3, 3e-3, 1.5e-3])
FORCE, POINT = 0.5, 5e-3
UNCERTAIN = """[all]
mass = "8 %"
centre = "8 mm"
radii = "6 %"
[loads]
force = "0.5 N"
point = "5 mm"
"""
STATED = """[motion.joint.joint1]
sd = "2 mrad"
[motion.joint.joint2]
sd = "3 mrad"
[motion.joint.joint3]
sd = "1.5 mrad"
"""


class Throws(NamedTuple):
    """Throws as they were measured, and what is true of them."""

    folder: Path
    push: Load
    truth: Mapping[str, Any]
    """Torques and shares of the true bodies in the true motion (throws, ...), as a result calls them."""


def swings(time: Any, draw: np.random.Generator) -> tuple[Any, Any, Any]:
    """Return q, qd and qdd (S, 3) of a dozen sines a joint, far slower than the cutoff."""
    omega, phase = 2.0 * np.pi * draw.uniform(0.1, 1.2, (12, 3)), draw.uniform(0.0, 2.0 * np.pi, (12, 3))
    angle = omega * time[:, None, None] + phase
    size = 0.35
    return tuple(size * a.sum(1) for a in (np.sin(angle), omega * np.cos(angle), -(omega**2) * np.sin(angle)))


@pytest.fixture(scope="module")
def throws(tmp_path_factory: pytest.TempPathFactory) -> Throws:
    folder, draw = tmp_path_factory.mktemp("throws"), np.random.default_rng(11)
    package = import_package(PLANAR3)
    time = np.arange(THROWS * APART) / RATE
    q, qd, qdd = swings(time, draw)
    write_csv(folder / "log.csv", np.column_stack([time, q + NOISE * draw.normal(size=q.shape)]))
    force, point = np.array([3.0, -5.0, 0.0]), np.array([0.2, 0.02, 0.0])
    push = Load(
        "push",
        "link3",
        force + FORCE * draw.normal(size=q.shape),
        point=point + POINT * draw.normal(size=q.shape),
        time=time,
    )
    motion = [a[APART // 2 :: APART] for a in (q, qd, qdd)]
    arms = package.load("numpy", bodies=drawn_bodies(package, THROWS, mass=0.08, centre=8e-3, radii=0.06))
    pose = arms.kinematics.pose(motion[0], "link3")
    wrench = np.tile(force, (THROWS, 1)), np.zeros((THROWS, 3)), pose[:, :3, 3] + pose[:, :3, :3] @ point
    borne = load_torque(arms, motion[0], "link3", wrench)
    whole, partial = arms.inverse_dynamics(*motion) + borne, arms.partial_torque(*motion)
    moving = motion[1]
    truth = {
        **dict(zip(("tau_qdd", "tau_qd", "tau_gravity"), arms.propagation(*motion), strict=True)),
        **{"tau": whole, "tau_link": partial, "tau_load": borne[..., None]},
        **{"power": whole * moving, "power_link": partial * moving[..., None]},
    }
    return Throws(folder, push, truth)


@pytest.mark.parametrize("noise", [STATED, "[motion]\nestimate = true\n"], ids=["stated", "estimated"])
def test_truth_lies_in_nine_of_ten_bands(throws: Throws, noise: str) -> None:
    (throws.folder / "off.toml").write_text(f"schema = 1\n{noise}{UNCERTAIN}")
    result = analyze(
        throws.folder / "log.csv",
        PLANAR3,
        processing=Processing(lowpass=Lowpass(8.0)),
        loads=[throws.push],
        uncertain=throws.folder / "off.toml",
    )
    told = {}
    for name, truth in throws.truth.items():
        found, deviation = (result.dense(of)[APART // 2 :: APART] for of in (name, f"sd/{name}"))
        there = deviation > 1e-9 * deviation.max()
        assert np.abs(found - truth)[~there].max(initial=0.0) < 1e-9
        told[name] = float((np.abs(found - truth)[there] < HALF_BAND * deviation[there]).mean())
    assert {name: share for name, share in told.items() if not 0.88 <= share <= 0.92} == {}, told
