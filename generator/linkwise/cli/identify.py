"""The command `identify`."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from linkwise.analysis.settings import Processing, Reading, choices
from linkwise.cli import Json, tell
from linkwise.cli.flags import takes
from linkwise.cli.log_options import UNITS, Backend, Log, RobotOption, opened_robot
from linkwise.errors import LinkwiseError
from linkwise.escape import json_text, listed, printable
from linkwise.identification import Fitting, Identification
from linkwise.identification import identify as identified
from linkwise.identification.identified_files import identified_files, record
from linkwise.identification.identified_robot import identified_robot, own_file
from linkwise.identification.uncertain_robot import FILE, doubt, note, uncertain_text, without
from linkwise.output import write_files
from linkwise.package.write import require_free
from linkwise.progress import progress as shown_progress
from linkwise.robot import Options

Out = Annotated[
    Path, typer.Option(help="Directory to write to: a page, a record, the robot, and how uncertain it is")
]
Uncertain = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="How uncertain the robot's bodies are: so is afterwards what torques do not tell, else certain",
    ),
]

app = typer.Typer(add_completion=False)


@app.command()
@takes(
    *("log", "robot", "out", "units", "time", "topic", "qpos", "map", "torque", "unmeasured"),
    *("torque_factor", "ignore_extra", "resample", ..., "loop_tolerance", "uncertain", "backend", "as_json"),
    without=("edges", "convention"),
)
def identify(
    log: Log,
    robot: RobotOption,
    out: Out,
    reading: Reading,
    processing: Processing,
    fitting: Fitting,
    options: Options,
    uncertain: Uncertain = None,
    backend: Backend = None,
    as_json: Json = False,
) -> None:
    """Identify links from a log of motion and torques: masses, centres, inertias, friction."""
    processing = replace(processing, edges="trim")
    own = own_file(robot)
    if own is not None:
        own.refuse_to_overwrite(out)
        if own.path.name == FILE:
            raise LinkwiseError(
                f"{robot}: a file {FILE} is written beside the robot's; give this another name"
            )
    with shown_progress() as progress:
        package = opened_robot(robot, backend, options, progress)
    require_free(out)
    with shown_progress(UNITS) as progress:
        found = identified(log, package, reading, processing, fitting, progress, uncertain)
    manifest = package.package.manifest
    of_robot, lost = identified_robot(found, manifest, own)
    if not without(found):
        written = own is not None and own.path.name in of_robot
        links = found.robot.links if written else tuple(map(printable, found.robot.links))
        of_robot |= {FILE: uncertain_text(found, links).encode()}
    told = (*(f"{log}: {warning}" for warning in found.warnings), *lost)
    found = replace(found, warnings=(*found.warnings, *lost))
    chosen = choices(reading, processing) | {
        "fitting": asdict(fitting),
        "uncertain": None if uncertain is None else str(uncertain),
    }
    files = write_files(out, identified_files(found, manifest, chosen, lost) | of_robot)
    for warning in told:
        tell(f"warning: {warning}", err=True)
    if found.log.ignored:
        tell(f"left out: {listed(found.log.ignored)}", err=True)
    if as_json:
        print(json_text(record(found)))
    else:
        tell(*_summary(found, files))


def _summary(found: Identification, files: Sequence[Path]) -> Iterator[str]:
    errors, sizes = found.errors(found.unseen if found.unseen.rows else found.seen), found.seen.sizes()
    what = "unseen" if found.unseen.rows else "fitted"
    yield (
        f"{found.seen.rows:,} samples at {found.log.rate:.6g} Hz: {found.base.count} combinations of "
        f"{found.own.size} parameters, condition number {found.fit.condition:.3g}"
    )
    if found.unmeasured:
        hidden = f"; not told without: {listed(found.base.hidden)}" if found.base.hidden else ""
        yield f"no torque of {listed(found.unmeasured)}{hidden}"
    if found.floating:
        yield f"no friction of {listed(found.floating)}: what floats has no bearings"
    if found.followers:
        shared = listed(found.shared_friction)
        counted = f"; the friction of {shared} counts in that of the others" if found.shared_friction else ""
        yield f"no torque of {listed(found.followers)}, which follow{counted}"
    for i, joint in enumerate(found.joints):
        yield (
            f"{joint}: torque {sizes[i]:.3g}, error {errors['fit'][i]:.3g} {what}, by the bodies "
            f"{errors['bodies'][i]:.3g}, by the package {errors['package'][i]:.3g} (root mean squares)"
        )
    yield without(found) or f"{FILE}: {note(found)}"
    yield from filter(None, [doubt(found)])
    which = "not clear which" if found.leaning is None else listed(found.leaning)
    yield f"torques by link that lean on what these do not tell: {which or 'none'}"
    yield from map(str, files)
