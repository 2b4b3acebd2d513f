"""Choices of an analysis, as `linkwise analyze` and the file of a study write them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from linkwise_runtime.quantities import Contact

from linkwise.analysis.contacts import Contacts, WhileColumn
from linkwise.analysis.contacts.pressed import PRESSED
from linkwise.analysis.cutoff_range import CutoffRange
from linkwise.analysis.loads import Load, Loads, Muscles
from linkwise.analysis.markers import MarkerChoices
from linkwise.analysis.named_bodies import named_body
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.settings import Payload, Processing, Reading
from linkwise.errors import LinkwiseError
from linkwise.option import option


@dataclass(frozen=True)
class AnalysisChoices:
    """Choices of an analysis: those of its parts, and what can be read only with the robot at hand.

    Files are given as paths. Methods raise LinkwiseError, which names the flag, for an invalid choice.
    """

    reading: Reading = field(default_factory=Reading)
    processing: Processing = field(default_factory=Processing)
    outputs: Outputs = field(default_factory=Outputs)
    payload: tuple[str, ...] = option(
        (),
        "Point mass on a body, at a point in its axes, m; NAME:BODY=… names it; may be repeated",
        metavar="BODY=KG,X,Y,Z",
    )
    load: tuple[str, ...] = option(
        (),
        "Constant force, N, in the world's axes, at a point in the body's, m; ,MX,MY,MZ behind FZ adds a"
        " moment, N·m; NAME:BODY=… names it; may be repeated",
        metavar="BODY=FX,FY,FZ@X,Y,Z",
    )
    loads: tuple[str, ...] = option(
        (),
        "Log of loads, columns BODY/force_x …, or OpenSim's external loads; may be repeated",
        metavar="FILE",
        is_file=True,
    )
    loads_cutoff: float | None = option(
        None, "Zero-phase low-pass for these loads, Hz; no filter if not given"
    )
    muscles: str | None = option(
        None,
        "Forces of muscles, as OpenSim's static optimization or computed muscle control writes them: each is"
        " a load on the bodies that it spans, and joint torques are what muscles leave; --robot is the .osim",
        metavar="FILE",
        is_file=True,
    )
    muscle_group: tuple[str, ...] = option(
        (),
        "Muscles that are one load, * standing for anything in a name, or a group of the model's by its"
        " name; may be repeated",
        metavar="NAME=MUSCLE,MUSCLE",
    )
    muscle_actuators: tuple[str, ...] = option(
        (),
        "OpenSim's ForceSet of actuators that the model lacks, such as reserves; may be repeated",
        metavar="FILE",
        is_file=True,
    )
    ik_tasks: str | None = option(
        None,
        "Of a log of markers: OpenSim's setup of inverse kinematics, or its tasks, with the markers' weights;"
        " all weigh alike if not given",
        metavar="FILE",
        is_file=True,
    )
    plate: tuple[str, ...] = option(
        (),
        "Of a .c3d file: the body that stands on a force plate, plates counted from 1; NAME:NUMBER=… names"
        " its load; may be repeated",
        metavar="NUMBER=BODY",
    )
    plate_threshold: float | None = option(
        None, "Force in N below which a plate counts as bare; 20 if not given"
    )
    c3d_axes: str | None = option(
        None,
        "Axes of the laboratory that are the model's x, and up, +X,+Z say; those that the .c3d file says if"
        " not given",
        metavar="X,UP",
    )
    contact: tuple[str, ...] = option(
        (),
        "Frame that the ground holds, at a point in its axes, m; KIND is held, point, hinged,AX,AY,AZ"
        " about an axis, rolling,RADIUS, or pressed or pressed-point where its measured load acts;"
        " NAME:FRAME=… names it; may be repeated",
        metavar="FRAME=KIND@X,Y,Z",
    )
    contact_while: tuple[str, ...] = option(
        (),
        "The contact is on while a column of the log is above a value, 0.5 if not given; may be repeated",
        metavar="NAME=COLUMN>VALUE",
    )
    contact_loads: tuple[str, ...] = option(
        (),
        "Loads measured at the contacts, read as --loads are: each contact is on while they come to"
        " more than --contact-threshold, and they load nothing; may be repeated",
        metavar="FILE",
        is_file=True,
    )
    contact_threshold: float | None = option(None, "Force in N; 20 if not given")
    unactuated: tuple[str, ...] = option(
        (),
        "Joint that nothing drives: its torque is a residual, and reactions are found by its equation; the"
        " floating base's if not given, none where motors drive that; may be repeated",
        metavar="JOINT",
    )

    uncertain: str | None = option(
        None,
        "How uncertain bodies, motion and loads are: a standard deviation stands beside each number",
        metavar="FILE",
        is_file=True,
    )
    cutoff_sweep: str | None = option(
        None,
        "Tell sizes of all torques at so many cutoffs between two too, Hz, 7 if not given, and which torques"
        " depend on them; goes with --cutoff, that of the analysis itself",
        metavar="LOW,HIGH[,COUNT]",
        is_key=False,
    )

    def __post_init__(self) -> None:
        for flag, given in (
            ("--muscle-group", self.muscle_group),
            ("--muscle-actuators", self.muscle_actuators),
        ):
            if given and self.muscles is None:
                raise LinkwiseError(f"{flag} goes with --muscles; add it")
        if self.cutoff_sweep is not None:  # refused before a robot is opened
            Request(processing=self.processing, cutoff_sweep=CutoffRange.of(self.cutoff_sweep))

    @property
    def files(self) -> tuple[str, ...]:
        """Paths of all files that choices name."""
        alone = (one for one in (self.uncertain, self.muscles, self.ik_tasks) if one is not None)
        return (*self.loads, *self.contact_loads, *self.muscle_actuators, *alone)

    def request(self, robot: OpenedRobot, file: str | Path) -> Request:
        """Return what is asked of a robot's log; file: the path of the robot's own file or package."""
        uncertain = None if self.uncertain is None else Path(self.uncertain)
        borne, held = self.borne(robot), self.contacts(robot)
        swept = None if self.cutoff_sweep is None else CutoffRange.of(self.cutoff_sweep)
        muscles = None
        if self.muscles is not None:
            beside = tuple(map(Path, self.muscle_actuators))
            muscles = Muscles(Path(self.muscles), Path(file), self.muscle_group, beside)
        asked = self.reading, self.processing, self.outputs, borne, held, uncertain, swept, muscles
        return Request(*asked, self.markers(Path(file)))

    def markers(self, model: Path) -> MarkerChoices:
        """Return how a log of markers is read; model: the path of the robot's own file."""
        tasks = None if self.ik_tasks is None else Path(self.ik_tasks)
        return MarkerChoices(
            model, tasks, self.plate, self.c3d_axes or "", self.plate_threshold, self.loads_cutoff
        )

    def payloads(self, robot: OpenedRobot) -> tuple[Payload, ...]:
        """Return the point masses that a robot carries."""
        return carried(self.payload, robot)

    def borne(self, robot: OpenedRobot) -> Loads:
        """Return the external loads on a robot."""
        given: list[Load | str] = [*constant_loads(self.load, robot), *self.loads]
        is_other = not self.loads and (self.contact_loads or self.plate)
        return Loads.of(given, None if is_other else self.loads_cutoff)

    def contacts(self, robot: OpenedRobot) -> Contacts:
        """Return the contacts on which the robot stands."""
        measured = [Path(path) for path in self.contact_loads]
        above = self.contact_threshold, self.loads_cutoff
        return chosen_contacts(self.contact, self.contact_while, measured, *above, self.unactuated, robot)


def carried(given: Sequence[str], robot: OpenedRobot) -> tuple[Payload, ...]:
    """Return the payloads of [NAME:]BODY=MASS[,x,y,z].

    Raises LinkwiseError for text of another form.
    """
    found = []
    for text in given:
        where, sign, numbers = text.rpartition("=")
        try:
            mass, *point = map(float, numbers.split(","))
        except ValueError:
            sign = ""
        if not (sign and where) or len(point) not in (0, 3):
            raise LinkwiseError(f"--payload {text}: write it as BODY=MASS,x,y,z, in kg and m")
        name, body = named_body(where, robot)
        x, y, z = point or (0.0, 0.0, 0.0)
        found.append(Payload(body, mass, (x, y, z), name))
    return tuple(found)


def constant_loads(given: Sequence[str], robot: OpenedRobot) -> tuple[Load, ...]:
    """Return the loads of [NAME:]BODY=FX,FY,FZ[,MX,MY,MZ][@X,Y,Z].

    Raises LinkwiseError for text of another form.
    """
    found = []
    for text in given:
        where, sign, numbers = text.rpartition("=")
        wrench, at, place = numbers.partition("@")
        try:
            force_and_moment = list(map(float, wrench.split(",")))
            point = list(map(float, place.split(","))) if at else [0.0, 0.0, 0.0]
        except ValueError:
            sign = ""
        if not (sign and where) or len(force_and_moment) not in (3, 6) or len(point) != 3:
            raise LinkwiseError(
                f"--load {text}: write it as BODY=FX,FY,FZ, or with moments behind them and with the point as"
                " BODY=FX,FY,FZ,MX,MY,MZ@X,Y,Z, in N, N·m and m"
            )
        name, body = named_body(where, robot)
        moment = force_and_moment[3:] or (0.0, 0.0, 0.0)
        found.append(Load(name or body, body, force_and_moment[:3], moment, point))
    return tuple(found)


NUMBERS = {
    "held": (),
    "point": (),
    "hinged": ("AX", "AY", "AZ"),
    "rolling": ("RADIUS",),
    **dict.fromkeys(PRESSED, ()),
}
"""Names of the numbers that follow each kind of contact."""


def chosen_contacts(
    contact: Sequence[str],
    while_above: Sequence[str],
    loads: Sequence[Path],
    threshold: float | None,
    cutoff: float | None,
    unactuated: Sequence[str],
    robot: OpenedRobot,
) -> Contacts:
    """Return the contacts that the flags describe; raise LinkwiseError for text of any other form.

    cutoff: cutoff of the low-pass filter for loads, in Hz
    """
    given = tuple(_contact(text, robot) for text in contact)
    columns: dict[str, WhileColumn] = {}
    for text in while_above:
        name, column = _while(text, [contact.name or "" for contact in given])
        if name in columns:
            raise LinkwiseError(f"--contact-while {text}: {name} has one already; give one for each contact")
        columns[name] = column
    low = cutoff if loads else None
    return Contacts(given, columns, tuple(loads), threshold, low, tuple(unactuated))


def _contact(text: str, robot: OpenedRobot) -> Contact:
    """Return the contact of a text [NAME:]FRAME=KIND[,NUMBERS][@X,Y,Z]."""
    where, sign, rest = text.rpartition("=")
    what, at, place = rest.partition("@")
    kind, *numbers = what.split(",")
    if not (sign and where and kind in NUMBERS):
        raise LinkwiseError(
            f"--contact {text}: write it as FRAME=KIND@X,Y,Z, the kind one of {', '.join(NUMBERS)}"
        )
    named = ",".join((kind, *NUMBERS[kind]))
    try:
        more = [float(number) for number in numbers]
        x, y, z = (float(number) for number in place.split(",")) if at else (0.0, 0.0, 0.0)
    except ValueError:
        raise LinkwiseError(f"--contact {text}: write it as FRAME={named}@X,Y,Z, in m") from None
    if len(more) != len(NUMBERS[kind]):
        raise LinkwiseError(f"--contact {text}: write it as FRAME={named}@X,Y,Z, in m")
    name, frame = named_body(where, robot)
    made = Contact(frame, kind, (x, y, z), name=name or frame)
    if kind == "hinged":
        return made._replace(axis=(more[0], more[1], more[2]))
    return made._replace(radius=more[0]) if more else made


def _while(text: str, names: Sequence[str]) -> tuple[str, WhileColumn]:
    """Return the name and column of a text NAME=COLUMN[>VALUE]; the name may have an equals sign."""
    name, sign, rest = text.partition("=")
    for own in names:
        if text.startswith(f"{own}=") and len(own) > len(name):
            name, rest = own, text[len(own) + 1 :]
    column, above, value = rest.rpartition(">")
    try:
        found = WhileColumn(column, float(value)) if above else WhileColumn(rest)
    except ValueError:
        found = WhileColumn(rest)
    if not (sign and name and rest):
        raise LinkwiseError(f"--contact-while {text}: write it as NAME=COLUMN>VALUE")
    return name, found
