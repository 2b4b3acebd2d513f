"""The command `identify`."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated

import typer

from linkwise.analysis.settings import Reading, choices
from linkwise.analysis.written_choices import chosen_lowpass, chosen_processing, pairs
from linkwise.cli import Json, tell
from linkwise.cli.log_options import (
    UNITS,
    AngleUnits,
    Backend,
    Cutoff,
    Degree,
    FilterOrder,
    How,
    IgnoreExtra,
    Log,
    LoopTolerance,
    Map,
    Pad,
    Positions,
    Resample,
    Time,
    Topic,
    Window,
)
from linkwise.cli.options import reads_robot
from linkwise.cli.robot_option import RobotOption, opened_robot
from linkwise.escape import json_text, listed
from linkwise.identification import Fitting, Identification
from linkwise.identification import identify as identified
from linkwise.identification.identified_files import identified_files, record
from linkwise.identification.identified_robot import identified_robot, own_file
from linkwise.output import require_writable, write_files
from linkwise.package.write import refuse_inside_package
from linkwise.progress import progress as shown_progress
from linkwise.robot import Options

Out = Annotated[Path, typer.Option(help="Directory to write to: a page, a record, and the robot")]
Torque = Annotated[
    list[str] | None,
    typer.Option("--torque", metavar="COLUMN=JOINT", help="Column of a joint's torque; may be repeated"),
]
Factor = Annotated[float, typer.Option(help="What brings torques to N m and forces to N: 0.001 for N mm")]
Unmeasured = Annotated[
    list[str] | None,
    typer.Option("--unmeasured", metavar="JOINT", help="Joint without a torque; may be repeated"),
]
Friction = Annotated[bool, typer.Option("--friction/--no-friction", help="Viscous and Coulomb friction")]
Unseen = Annotated[float, typer.Option(help="Share of the log, its end, to predict and not to fit")]

app = typer.Typer(add_completion=False)


@app.command()
@reads_robot()
def identify(
    options: Options,
    log: Log,
    robot: RobotOption,
    out: Out,
    units: AngleUnits = None,
    time: Time = None,
    topic: Topic = None,
    qpos: Positions = None,
    mapping: Map = None,
    torque: Torque = None,
    unmeasured: Unmeasured = None,
    torque_factor: Factor = 1.0,
    ignore_extra: IgnoreExtra = False,
    resample: Resample = None,
    derivative: How = "five-point",
    window: Window = None,
    degree: Degree = None,
    cutoff: Cutoff = None,
    filter_order: FilterOrder = None,
    padding: Pad = None,
    friction: Friction = True,
    unseen: Unseen = 0.2,
    loop_tolerance: LoopTolerance = 0.01,
    backend: Backend = None,
    as_json: Json = False,
) -> None:
    """What a log of motion and torques says of the links: masses, centres, inertias, friction."""
    reading = Reading(
        units, time, pairs("--map", mapping or []), ignore_extra, resample, loop_tolerance, topic, qpos
    )
    lowpass = chosen_lowpass(cutoff, filter_order, padding)
    processing = chosen_processing(derivative, window, degree, lowpass, "trim")
    without = tuple(unmeasured or [])
    fitting = Fitting(pairs("--torque", torque or []), torque_factor, friction, unseen, without)
    own = own_file(robot)
    if own is not None:
        own.refuse_to_overwrite(out)
    with shown_progress() as progress:
        package = opened_robot(robot, backend, options, progress)
    refuse_inside_package(out)
    require_writable(out)
    with shown_progress(UNITS) as progress:
        found = identified(log, package, reading, processing, fitting, progress)
    manifest = package.package.manifest
    of_robot, lost = identified_robot(found, manifest, own)
    told = (*(f"{log}: {warning}" for warning in found.warnings), *lost)
    found = replace(found, warnings=(*found.warnings, *lost))
    chosen = choices(reading, processing) | {"fitting": asdict(fitting)}
    files = write_files(out, identified_files(found, manifest, chosen, lost) | of_robot)
    for warning in told:
        tell(f"warning: {warning}", err=True)
    if found.log.ignored:
        tell(f"left out: {listed(found.log.ignored)}", err=True)
    if as_json:
        print(json_text(record(found)))
    else:
        tell(*_told(found, files))


def _told(found: Identification, files: Sequence[Path]) -> Iterator[str]:
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
    yield from map(str, files)
