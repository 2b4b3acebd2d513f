"""`analyze` to a directory: the table, its record, figures and the page."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwise.analysis.directory import whole_directory
from linkwise.analysis.figures import check_name, draw
from linkwise.analysis.page import NUMBERS, SAMPLES, report
from linkwise.analysis.result import Analysis
from linkwise.analysis.robot import Robot
from linkwise.analysis.run import Array, Keep, prepare, stride_for
from linkwise.analysis.settings import Processing, Reading, record
from linkwise.analysis.tables import Format, open_table
from linkwise.progress import Progress

RECORD = "analysis.json"
"""The record, and the mark by which a directory is known to hold a former result."""


@dataclass(frozen=True)
class Wanted:
    """Which files to write: the table's format, figures by name, and whether the page."""

    table: Format = "parquet"
    figures: tuple[str, ...] = ()
    page: bool = True


def analyze_to(
    out: Path,
    log: Path,
    robot: Robot,
    reading: Reading,
    processing: Processing,
    wanted: Wanted,
    progress: Progress,
) -> tuple[Analysis, Sequence[Path]]:
    """Analyse a log of any length with flat memory; `out` appears when everything is done.

    Returns the analysis thinned to what a page shows, and the files written. Raises LinkwiseError.
    """
    for name in wanted.figures:
        check_name(name, robot)
    with whole_directory(out, RECORD) as draft:
        job = prepare(log, robot, reading, processing, progress, draft)
        columns = job.terms.columns
        keep = Keep(len(columns), stride_for(job.count, len(columns), NUMBERS, SAMPLES))
        note = json.dumps({"log": log.name, "robot": robot.name, **record(reading, processing)})
        with open_table(draft / f"analysis.{wanted.table}", columns, note) as table:

            def sink(block: Array) -> None:
                keep(block)
                table(block)

            analysis = job.analysis(job.run(sink, progress), keep)
        text = json.dumps(analysis.record(), indent=1, ensure_ascii=False, allow_nan=False)
        (draft / RECORD).write_text(text + "\n", encoding="utf-8")
        for name in wanted.figures:
            file = draft / f"{name.replace(':', '-').replace('/', '-')}.png"
            draw(analysis, name).savefig(file, dpi=160)
        if wanted.page:
            (draft / "report.html").write_text(report(analysis), encoding="utf-8")
        names = sorted(file.name for file in draft.iterdir())
    return analysis, [out / name for name in names]
