"""Result of `python tests/tools/learn_damping.py`: gains of a controller are learned through time."""

from collections.abc import Callable
from types import ModuleType

import pytest

torch = pytest.importorskip("torch")
learning = pytest.importorskip("tools.learn_damping")


def test_damping_is_learned_through_the_motion(package_of: Callable[[str], ModuleType]) -> None:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # threads wait for one another at every small operation where cores are busy
    begun, *later = learning.descent(package_of("planar3").load("torch"), 2)
    torch.set_num_threads(threads)
    losses = [learnt.loss for learnt in (begun, *later)]
    assert losses == sorted(losses, reverse=True)
    # In theory (r + 1/r) / 2 for damping of r times the best, over all time.
    assert losses[0] == pytest.approx((learning.BEGIN + 1.0 / learning.BEGIN) / 2.0, rel=0.01)
    assert losses[-1] == pytest.approx(1.0, rel=0.002)
    assert later[-1].ratio == pytest.approx([1.0] * 3, rel=0.05)
