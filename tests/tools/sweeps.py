"""Run long sweeps, as `make NAME` does, and tell in docs/sweeps.md when, where and with which figures.

    python tests/tools/sweeps.py random exports

What a sweep prints goes to out/sweeps; the last line of each of its commands is its figure.
"""

import argparse
import datetime
import platform
import shlex
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/sweeps.md"
SWEEPS = ("same", "random", "exports", "corpus", "opensim", "fuzz", "crash", "mutate", "pythons", "bench")
"""Targets of the Makefile, the shorter ones first."""
MARK, END = "<!-- from here on by tests/tools/sweeps.py -->\n", "<!-- to here -->"
HEAD = "| sweep | on | commit | where | minutes | it said |\n|---|---|---|---|---:|---|\n"
NEVER = "never since this page began"
LONGEST = 300


@dataclass(frozen=True)
class Ran:
    """A sweep that ran: its status is not 0 where it found something."""

    name: str
    status: int
    minutes: float
    said: tuple[str, ...]

    def row(self, on: str, commit: str, where: str) -> str:
        """The row of the page."""
        end = "" if self.status == 0 else f"**ended with {self.status}**; "
        said = end + "; ".join(self.said)
        shown = said.replace("|", "\\|").replace("<", "&lt;")[:LONGEST]
        return f"| `make {self.name}` | {on} | {commit} | {where} | {self.minutes:.0f} | {shown} |"


def run(name: str, variables: Sequence[str], folder: Path) -> Ran:
    """Run the commands of a target one after the other, to the end, whatever they end with."""
    listed = subprocess.run(
        ["make", "--dry-run", "--no-print-directory", name, *variables],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    said, status, start = [], 0, time.monotonic()
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{name}.log").open("w", encoding="utf-8") as log:
        for command in listed.stdout.splitlines():
            began = log.tell()
            ended = subprocess.run(
                shlex.split(command), cwd=ROOT, stdout=log, stderr=subprocess.STDOUT, check=False
            )
            status = status or ended.returncode
            log.flush()
            with Path(log.name).open(encoding="utf-8", errors="replace") as printed:
                printed.seek(began)
                lines = [line.strip() for line in printed.read().splitlines() if line.strip()]
            said += lines[-1:]
    return Ran(name, status, (time.monotonic() - start) / 60, tuple(said))


def rows_of(page: str) -> dict[str, str]:
    """Rows of the page by the sweep's name."""
    table = page.partition(MARK)[2].partition(END)[0].removeprefix(HEAD)
    return {line.split("`")[1].removeprefix("make "): line for line in table.splitlines() if line}


def written(page: str, new: Mapping[str, str]) -> str:
    """The page with new rows in place of former ones, all in the order of the sweeps."""
    before, after = page.partition(MARK)[0], page.partition(END)[2]
    known = {**rows_of(page), **new}
    rows = [known.get(name, f"| `make {name}` | {NEVER} | | | | |") for name in SWEEPS]
    return before + MARK + HEAD + "".join(f"{row}\n" for row in rows) + END + after


def processor() -> str:
    """Name of the processor, and the number of its cores that are here."""
    found = Path("/proc/cpuinfo")
    lines = found.read_text(encoding="utf-8").splitlines() if found.is_file() else []
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    return f"{len(names)} cores of {names[0]}" if names else platform.machine()


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status 1 where a sweep found something."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(SWEEPS)}; all if none is given")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="for make")
    wanted = parser.parse_args(arguments)
    if unknown := [name for name in wanted.names if name not in SWEEPS]:
        parser.error(f"no such sweep: {', '.join(unknown)}")
    # What all targets need is there first, as its commands are none of a sweep.
    subprocess.run(["make", "--silent", ".venv/.ready"], cwd=ROOT, check=True, stdout=sys.stderr)
    changed = subprocess.run(
        ["git", "status", "--porcelain", "--", ".", f":!{PAGE.relative_to(ROOT)}"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    if changed:
        parser.error(f"the row names a commit, and the tree has changes beside it:\n{changed}")
    commit = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()
    where = f"{platform.system()}, Python {platform.python_version()}, {processor()}"
    is_bad = False
    for name in wanted.names or SWEEPS:
        on = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
        ran = run(name, wanted.set, ROOT / "out/sweeps")
        is_bad |= ran.status != 0
        row = ran.row(on, commit, where)
        print(row, flush=True)
        PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), {name: row}), encoding="utf-8")
    return int(is_bad)


if __name__ == "__main__":
    sys.exit(main())
