"""Request of a log: how it is read, what the robot bears in it, and what is told and written of it."""

from dataclasses import dataclass, field
from pathlib import Path

from linkwise.analysis.asked_trace import TraceChoices
from linkwise.analysis.contacts import Contacts
from linkwise.analysis.cutoff_range import CutoffRange
from linkwise.analysis.loads import Loads, Muscles
from linkwise.analysis.markers import MarkerChoices
from linkwise.analysis.outputs import Format
from linkwise.analysis.phases import Phase
from linkwise.analysis.settings import Processing, Reading, Units
from linkwise.errors import LinkwiseError
from linkwise.option import option
from linkwise.plotstyle import FigureFormat


@dataclass(frozen=True)
class Outputs:
    """Files to write, and their contents: the table's format, figures by name, whether to write the page."""

    table: Format = option("parquet", "Format of the table; none for no table", "--format", is_key=False)
    figures: tuple[str, ...] = option(
        (),
        "paper or causes, alone or with :JOINT, shares, power, energy, energy:PHASE, induced, induced:POINT,"
        " reaction or trace, alone or with :JOINT, contacts, or cutoff; may be repeated",
        "--figure",
        is_key=False,
    )
    page: bool = option(True, "Write report.html", is_key=False)
    phases: tuple[Phase, ...] = option(
        (),
        "Part of the movement that the figure causes holds against the rest: WHAT is a load or contact,"
        " a column COLUMN>VALUE of the log, or FROM..TO in s; may be repeated",
        "--phase",
        metavar="NAME/REST=WHAT",
        read=lambda texts: tuple(map(Phase.of, texts)),
    )
    columns: tuple[str, ...] = option(
        (),
        "Columns that are computed and written: all; sums, those of joints; by-cause, with net torques by"
        " cause; causes, with torques by cause through each link; or names, * standing for anything in a part"
        " of one, ** for any parts; may be repeated",
        metavar="WHICH",
    )
    power_terms: bool = option(False, "Write power by cause and order too")
    """True to add power by cause and order: as many columns again as torques have."""
    induced: tuple[str, ...] = option(
        (),
        "Tell an acceleration by its sources: FRAME or FRAME,X,Y,Z in m, joints, or centre-of-mass; may "
        "be repeated",
        metavar="POINT",
    )
    induced_whole: bool = option(
        False, "Tell weights, and all that velocities do, as one source each, not by link and joint"
    )
    storage: str = option(
        "",
        "Also write OpenSim's storage files: NAME_InverseDynamics.sto, shares of each coordinate, and what "
        "--induced tells",
        "--sto",
        metavar="NAME",
        is_key=False,
    )
    storage_units: Units = option(
        "rad", "Unit of their angles; rad if not given", "--sto-units", needs="--sto", is_key=False
    )
    induced_power: bool = option(
        False, "Tell by its sources the power that each link gets, and that which flows through each joint"
    )
    reactions: tuple[str, ...] = option(
        (),
        "Tell the whole wrench that a joint carries by its causes, in the joint's axes, or those of AXES: "
        "world or a body; may be repeated",
        "--reaction",
        metavar="JOINT[,AXES]",
    )
    figure_format: FigureFormat = option(
        "png", "Format of the figures; png if not given", needs="--figure", is_key=False
    )
    trace: TraceChoices = field(default_factory=TraceChoices)

    @property
    def tells_of_all(self) -> bool:
        """True if something else is told that is made of all torques: figures, the page, other sources."""
        figures = self.page, self.figures, self.induced, self.induced_power, self.trace.joints
        return any(figures)

    def __post_init__(self) -> None:
        for flag, given, needed, there in (
            ("--sto-units", self.storage_units != "rad", "--sto", self.storage),
            ("--induced-whole", self.induced_whole, "--induced", self.induced),
        ):
            if given and not there:
                raise LinkwiseError(f"{flag} goes with {needed}; add it")


@dataclass(frozen=True)
class Request:
    """Request of a log: how it is read and derived, what the robot bears in it, and what is written."""

    reading: Reading = field(default_factory=Reading)
    processing: Processing = field(default_factory=Processing)
    outputs: Outputs = field(default_factory=Outputs)
    loads: Loads = field(default_factory=Loads)
    contacts: Contacts = field(default_factory=Contacts)
    uncertain: Path | None = None
    """File of how uncertain bodies are."""
    cutoff_sweep: CutoffRange | None = None
    """Cutoffs at which sizes of torques are told too."""
    muscles: Muscles | None = None
    """Forces of muscles, which are loads too."""
    markers: MarkerChoices | None = None
    """Reading of a log of markers and plates."""

    def __post_init__(self) -> None:
        for flag, given in (("--uncertain", self.uncertain), ("--cutoff-sweep", self.cutoff_sweep)):
            if self.muscles is not None and given is not None:
                raise LinkwiseError(
                    f"{flag}: paths of muscles are found for the one motion that is analysed; leave it or"
                    " --muscles out"
                )
        if self.cutoff_sweep is not None and self.processing.lowpass is None:
            raise LinkwiseError("--cutoff-sweep goes with --cutoff, that of the analysis itself; add it")
