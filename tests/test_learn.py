"""What `python tests/learn.py` shows: noisy torques teach a robot its numbers, by whatever gradients."""

from pathlib import Path

import pytest

pytest.importorskip("torch")

from conftest import needs_compiler
from learn import WAYS, Numbers, learn, packages


@pytest.fixture(scope="module")
def ways(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Numbers]:
    return packages(Path(tmp_path_factory.mktemp("learn")))


@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
@needs_compiler
@pytest.mark.parametrize("way", WAYS)
def test_torques_of_other_motions_are_learned_far_below_the_noise(way: str, ways: dict[str, Numbers]) -> None:
    found = learn(ways[way], 7, 2000, noise=0.05)
    assert (found.told_apart, found.of) == (25, 28)
    assert found.began > 1.0
    least = 0.05 * (found.told_apart / (2000 * 7)) ** 0.5  # what noise alone leaves of a least-squares fit
    assert found.ended < 1.5 * least
