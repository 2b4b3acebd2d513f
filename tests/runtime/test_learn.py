"""Result of `python tests/tools/learn.py`: noisy torques teach a robot its numbers, by whatever
gradients."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import needs_compiler

torch = pytest.importorskip("torch")
learning = pytest.importorskip("tools.learn")


@pytest.fixture(scope="module")
def ways(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    made: dict[str, Any] = learning.packages(Path(tmp_path_factory.mktemp("learn")))
    return made


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Threads wait for one another at every small operation where cores are busy."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")
@needs_compiler
@pytest.mark.parametrize("way", learning.WAYS)
def test_torques_of_other_motions_are_learned_far_below_the_noise(way: str, ways: dict[str, Any]) -> None:
    found = learning.learn(ways[way], 7, 2000, noise=0.05)
    assert (found.told_apart, found.of) == (25, 28)
    assert found.began > 1.0
    least = 0.05 * (found.told_apart / (2000 * 7)) ** 0.5  # what noise alone leaves of a least-squares fit
    assert found.ended < 1.5 * least
