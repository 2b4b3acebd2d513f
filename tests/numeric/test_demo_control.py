"""Result that `make demo-control` shows: how far a push moves Panda's hand, limp, soft and stiff."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from conftest import PANDA, needs_compiler

pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")

from tools import demo_control
from tools.demo_control import PERIOD, PUSH, STOP

from numeric.mujoco_plant import PANDA_AT_WORK, panda_model

pytestmark = [
    needs_compiler,
    pytest.mark.skipif(not PANDA.is_file(), reason="needs real robots: pip install example-robot-data"),
]


def test_the_hand_goes_as_far_as_force_by_stiffness(package_of: Callable[[str], ModuleType]) -> None:
    package = package_of(str(PANDA))
    limp, *held = demo_control.pushed(package, panda_model(PANDA), PANDA_AT_WORK)
    end = round(STOP / PERIOD) - 1
    assert limp.hand[end, 1] > 0.5
    for run in held:
        assert run.hand[end, 1] == pytest.approx(PUSH / run.stiffness, rel=0.01)
        assert np.abs(run.hand[-1]).max() < 0.002, "and comes back"
    png = demo_control.picture([limp, *held], None, package.load("numpy"))
    assert png.startswith(b"\x89PNG")
    assert len(png) > 50_000
