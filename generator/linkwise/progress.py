"""Progress of long work on stderr: a bar with rate and time left on a terminal, plain lines elsewhere.

The bar goes when the work ends, and the lines begin only where it takes long: what is printed then, above all
an error, stands alone.
"""

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.text import Text

QUIET = 10.0
"""Seconds of work before the first plain line."""

Progress = Callable[[str, int, int], None]
"""Function called with the name of a stage, how much of it is done, and how much there is."""


def silent(stage: str, done: int, whole: int) -> None:
    """Report no progress."""


@contextmanager
def progress(units: Mapping[str, str] | None = None) -> Iterator[Progress]:
    """Yield a function to report progress to; `units` gives the unit of a stage's rate, by default steps."""
    if not sys.stderr.isatty():
        yield _lines()
        return
    columns = (TextColumn("{task.description:<10}"), BarColumn(), TextColumn("{task.percentage:>3.0f}%"))
    rate = _Rate(units or {})
    with Bar(
        *columns,
        rate,
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        tasks: dict[str, int] = {}

        def update(stage: str, done: int, whole: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=whole)
            bar.update(tasks[stage], completed=done)  # type: ignore[arg-type]

        yield update


class _Rate(ProgressColumn):
    """Column of the rate, in units a second."""

    def __init__(self, units: Mapping[str, str]) -> None:
        super().__init__()
        self.units = units

    def render(self, task: Task) -> Text:
        """Return the rate so far, blanks before there is one."""
        unit = f"{self.units.get(task.description, 'steps')}/s"
        speed = task.finished_speed or task.speed
        return Text(f"{speed:>12,.0f} {unit:<9}" if speed else " " * 22)


def _lines() -> Progress:
    """Return a function that prints a line for each tenth of a stage, once work is long.

    A stage of few steps has a line for its end alone.
    """
    last: dict[str, int] = {}
    start = time.monotonic()

    def update(stage: str, done: int, whole: int) -> None:
        tenth = 10 * done // whole if whole else 10
        if tenth > last.get(stage, -1) and (tenth == 10 or whole > 100):
            last[stage] = tenth
            if time.monotonic() - start < QUIET:
                return
            print(f"{stage}: {10 * tenth}%", file=sys.stderr)

    return update
