"""Progress of long work: a bar with rate and time left on a terminal, plain lines elsewhere."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from linkwise.motion.samples import Progress as Report


@contextmanager
def shown_progress() -> Iterator[Report]:
    """Yield what to report progress to, on standard error."""
    if sys.stderr.isatty():
        with _bar() as bar:
            tasks: dict[str, int] = {}

            def update(stage: str, done: int, whole: int) -> None:
                if stage not in tasks:
                    tasks[stage] = bar.add_task(stage, total=whole)
                bar.update(tasks[stage], completed=done)  # type: ignore[arg-type]

            yield update
    else:
        yield _lines()


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description:<10}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        _Rate(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    )


class _Rate(ProgressColumn):
    """Bytes or samples a second."""

    def render(self, task: Task) -> Text:
        """Rate so far."""
        unit = "B/s" if task.description == "reading" else "samples/s"
        speed = task.finished_speed or task.speed
        return Text(f"{speed:>12,.0f} {unit:<9}" if speed else " " * 22)


def _lines() -> Report:
    last: dict[str, int] = {}

    def update(stage: str, done: int, whole: int) -> None:
        tenth = 10 * done // whole if whole else 10
        if tenth > last.get(stage, -1) and (tenth == 10 or stage in last or done < whole):
            last[stage] = tenth
            print(f"{stage}: {10 * tenth}%", file=sys.stderr)

    return update
