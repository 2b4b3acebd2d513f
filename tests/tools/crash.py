"""`generate` and `analyze` killed, and given errors, at each system call that touches files; `make crash`.

Over an earlier output, with the system's exchange of two folders and without it. After each fault the earlier
output or the new one is there whole, and the next run leaves the new one and nothing else.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.faults import NO_EXCHANGE, Fault, command, faults, suffer, untraceable
from linkwise.output import sweep

EARLIER = {
    "generate": "generate planar2 --backend numpy --backend c --name target --out {place}",
    "analyze": "analyze {home}/motion/recorded.csv --robot {home}/robot/planar3 --format csv --cutoff 4"
    " --out {place}/target",
}
NEXT = {
    "generate": "generate planar2 --backend numpy --name target --out {place}",
    "analyze": "analyze {home}/motion/recorded.csv --robot {home}/robot/planar3 --format csv --no-page"
    " --out {place}/target",
}
WAYS: dict[str, tuple[str, ...]] = {"exchange": (), "renames": (NO_EXCHANGE,)}
WHATS = ("signal=SIGKILL", "error=ENOSPC", "error=EIO")

Tree = dict[str, bytes]


def linkwise(line: str, home: Path, place: Path) -> None:
    """Run a command in a process of its own."""
    words = line.format(home=home, place=place).split()
    subprocess.run([sys.executable, "-m", "linkwise", *words], check=True, capture_output=True)


def tree(place: Path) -> Tree:
    """Every file of a folder."""
    return {
        file.relative_to(place).as_posix(): file.read_bytes() for file in place.rglob("*") if file.is_file()
    }


def copied(earlier: Path, where: Path) -> None:
    shutil.rmtree(where, ignore_errors=True)
    shutil.copytree(earlier, where / "target")


def wrong(where: Path, status: int, trees: tuple[Tree, Tree], atomic: bool) -> str:
    """Return what is not as promised after a fault; empty if nothing."""
    if not (where / "target").exists():
        if atomic:
            return "the output is gone"
        sweep(where)
    left = tree(where / "target")
    if left not in trees:
        return "neither the earlier output nor the new one is there"
    if status not in (0, 2, -9):
        return "it ended otherwise than by an error that is told"
    if status == 2 and left != trees[0]:
        return "said that nothing was written, but there is a new output"
    if status == 0 and left != trees[1]:
        return "said nothing, but the earlier output is there"
    return ""


def tried(job: str, home: Path, way: str, what: str) -> int:
    """Strike at every call; returns how many faults ended otherwise than promised."""
    earlier, new, places = home / f"{job}-earlier", home / f"{job}-new", home / "places"
    places.mkdir()
    for name in ("motion", "robot"):
        (places / name).symlink_to(home / name)
    trees = tree(earlier / "target"), tree(new / "target")
    prepare = partial(copied, earlier / "target")
    plan: list[Fault] = faults(job, places, prepare, WAYS[way])
    ends = suffer(job, places, prepare, plan, what, WAYS[way])
    failures = 0
    for number, (fault, end) in enumerate(zip(plan, ends, strict=True)):
        where = places / str(number)
        complaint = wrong(where, end.status, trees, atomic=way == "exchange")
        if not complaint:
            with open(os.devnull, "w") as nothing, redirect_stdout(nothing), redirect_stderr(nothing):
                command(NEXT[job].format(home=home, place=where))()
            if tree(where) != {f"target/{name}": content for name, content in trees[1].items()}:
                complaint = "the next run left something else than the new output"
        if complaint:
            failures += 1
            print(f"FAIL  {job}, {way}, {what} at {fault.call} {fault.number}: {complaint}; {end.said}")
    ended = ", ".join(
        f"{count} ended with {status}" for status, count in Counter(e.status for e in ends).items()
    )
    print(f"{len(plan) - failures:4} of {len(plan)} as promised: {job}, {way}, {what} ({ended})", flush=True)
    shutil.rmtree(places)
    return failures


def main() -> int:
    if untraceable():
        print(f"nothing was tried: {untraceable()}")
        return 1
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        linkwise("generate planar3 --backend numpy --out {home}/robot", home, home)
        linkwise("motion --out {home}/motion", home, home)
        failures = 0
        for job in EARLIER:
            linkwise(EARLIER[job], home, home / f"{job}-earlier")
            linkwise(NEXT[job], home, home / f"{job}-new")
            failures += sum(tried(job, home, way, what) for what in WHATS for way in WAYS)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
