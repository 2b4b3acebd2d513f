"""Stack that functions take together with those that they call, from what gcc says of each."""

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

from helpers.kept import run_kept


def deepest(command: Sequence[str], source: Path) -> dict[str, int]:
    """Bytes of each function of a C file that others may call; what is in other files counts as nothing."""
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "robot.o"
        run_kept([*command, "-fcallgraph-info=su", "-c", source], made)
        text = made.with_suffix(".ci").read_text(encoding="utf-8")
    nodes = re.findall(r'node: { title: "([^"]*)" label: "[^"]*?\\n(\d+) bytes \(([a-z,]+)\)', text)
    assert {kind for _, _, kind in nodes} <= {"static", "dynamic,bounded"}, (
        "no function's stack hangs on what it is given"
    )
    own = {name: int(size) for name, size, _ in nodes}
    calls: dict[str, set[str]] = {}
    for caller, called in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', text):
        calls.setdefault(caller, set()).add(called)
    known: dict[str, int] = {}

    def depth(name: str, above: tuple[str, ...] = ()) -> int:
        assert name not in above, "no function calls itself"
        if name not in known:
            below = (depth(called, (*above, name)) for called in calls.get(name, ()))
            known[name] = own.get(name, 0) + max(below, default=0)
        return known[name]

    return {name: depth(name) for name in own if ":" not in name}
