"""Options of all commands that read a log: the log, its robot and the back end that computes.

The robot is a package, or a robot's file, of which one is made.
"""

from pathlib import Path
from typing import Annotated

import typer

from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.cli import tell
from linkwise.cli.flags import tell_run
from linkwise.errors import LinkwiseError
from linkwise.package_cache import kept_package
from linkwise.progress import Progress
from linkwise.robot import Options

UNITS = {
    "inverse kinematics": "files",
    "reading": "B",
    "resampling": "samples",
    "closing": "samples",
    "analysing": "samples",
    "sweeping": "samples",
    "fitting": "samples",
}
"""Units in which progress is counted, by stage."""

_LOG = typer.Argument(
    help="Motion log: .csv, .mot, .sto, .parquet, .npz, HDF5, a bag of ROS, or markers in .trc or .c3d"
)
_ROBOT = typer.Option(
    help="Directory of a generated robot; or a robot's file, of which a package is kept", show_default=False
)
Log = Annotated[Path, _LOG]
LogIfAny = Annotated[Path | None, _LOG]
RobotOption = Annotated[Path, _ROBOT]
RobotIfAny = Annotated[Path | None, _ROBOT]
Backend = Annotated[str | None, typer.Option(help="Back end of the package; its fastest if not given")]


def opened_robot(robot: Path, backend: str | None, options: Options, progress: Progress) -> OpenedRobot:
    """Load the robot; report that it was run, if it is a program, and what of its file affects the torques.

    Raises LinkwiseError.
    """
    kept = kept_package(robot, backend, options, progress)
    tell_run(robot)
    for warning in kept.warnings:
        tell(f"warning: {warning}", err=True)
    try:
        return load_robot(kept.directory, backend, "" if kept.directory == robot else str(robot))
    except LinkwiseError as error:  # names the file of the user's, not the package that is kept of it
        raise LinkwiseError(str(error).replace(str(kept.directory), str(robot))) from error
