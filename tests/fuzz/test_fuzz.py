"""Broken input of every kind ends in one line or in a right result; `make fuzz` does this for an hour."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from fuzz.case import Case
from fuzz.cases import KINDS
from fuzz.client import Client

TESTS = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with Client() as started:
        yield started


@pytest.mark.parametrize("kind", KINDS)
def test_broken_input_is_refused_in_one_line_or_answered(kind: str, client: Client) -> None:
    # The same cases each time; making one smaller takes minutes, and the message has all of it.
    @settings(
        max_examples=15,
        derandomize=True,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.randoms(use_true_random=False))
    def run(rng: Random) -> None:
        case = KINDS[kind](rng)
        outcome = client.run(case)
        assert not outcome.faults, (case, outcome)

    run()


BAD = {
    "traceback": (Case(("inspect", "{in}/a.py"), {"a.py": b"raise BaseException"}), "BaseException"),
    "two lines": (
        Case(("inspect", "{in}/a.py"), {"a.py": b"import sys; print('x', file=sys.stderr); 1 / 0"}),
        "2 lines on stderr with exit status 2",
    ),
    "file outside": (
        Case(("inspect", "{in}/a.py"), {"a.py": b"open('/tmp/linkwise-fuzz', 'w')"}),
        "outside: open /tmp/linkwise-fuzz",
    ),
    "file left": (Case(("inspect", "{in}/a.py"), {"a.py": b"open('left', 'w')"}), "left work/left behind"),
    "memory": (Case(("inspect", "{in}/a.py"), {"a.py": b"x = b'1' * (3 << 29)"}), "took 1."),
    "hang": (Case(("inspect", "{in}/a.py"), {"a.py": b"while True: pass"}), "Hang"),
    "death": (Case(("inspect", "{in}/a.py"), {"a.py": b"import os; os.kill(os.getpid(), 9)"}), "status -9"),
}


@pytest.fixture(scope="module")
def hasty() -> Iterator[Client]:
    with Client(seconds=3.0, modules=("linkwise.cli.inspect",)) as started:
        yield started


@pytest.mark.parametrize("fault", BAD)
def test_every_fault_is_noticed(fault: str, hasty: Client) -> None:
    case, found = BAD[fault]
    outcome = hasty.run(case)
    assert any(found in text for text in outcome.faults), outcome


def test_fuzzer_runs_a_seed_again(tmp_path: Path) -> None:
    command = [sys.executable, str(TESTS / "fuzz" / "run.py"), "--kind", "toml", "--count", "3"]
    done = subprocess.run([*command, "--out", str(tmp_path)], capture_output=True, text=True, check=False)
    assert "3 cases in" in done.stdout
    assert done.returncode == int("0 findings" not in done.stdout)
