"""Content of a study, as its file describes it."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from linkwise.analysis.choices import AnalysisChoices
from linkwise.analysis.net_causes import NET
from linkwise.analysis.phases import Phase
from linkwise.errors import LinkwiseError
from linkwise.escape import column_part, listed
from linkwise.option import written
from linkwise.plotstyle import FigureFormat
from linkwise.robot import Options
from linkwise.study.corrections import Correction
from linkwise.study.subjects import SubjectSize

SUBJECT = "subject"
"""Factor that every study has, and the first."""
RIGHT, LEFT = SIDES = ("right", "left")
SIDE = "side"
"""Factor of a study whose cycles are of two sides, apart."""
OF_EITHER = re.compile("[Ii]psi|[Cc]ontra")
"""Words for the side whose cycle it is and for the other, in names of columns."""
OF_FILES = tuple(one.key for one in written(AnalysisChoices) if one.option.is_file)
"""Choices that are paths of files."""
WIDTHS = {"single": "90 mm", "double": "180 mm"}
"""Widths of figures over one and over two columns of a journal."""
NARROW = 120.0
"""Width in mm below which panels stand below each other."""
CAUSES = "causes:"
"""Beginning of what a figure names in place of columns: what loads the joint that follows."""
Normalise = Literal["", "none", "mass", "weight*height"]
POINTS = 101
"""Number of points of a cycle, 0 to 100 %."""


@dataclass(frozen=True)
class Cycles:
    """Cycles of a trial: `start` begins a cycle each time, `during` is one as long as it lasts.

    Both are written as a phase's WHAT of `linkwise analyze`, by side, "" where cycles are of none. `table` is
    a CSV file of trial, start, end in s and, with `sides`, side. Cycles shorter than `shortest` or longer
    than `longest`, in s, are left out. `integrals` are patterns of columns that are integrated over each
    cycle, those of power that tables keep if there are none.

    `sides` has cycles of the right and of the left: `apart`, by a factor `side`, or `pooled`. `turned` are
    the coordinates that change sign in those of the left; None finds them by the robot's geometry.
    """

    start: Mapping[str, str] = field(default_factory=dict)
    during: Mapping[str, str] = field(default_factory=dict)
    table: str = ""
    sides: Literal["", "apart", "pooled"] = ""
    turned: tuple[str, ...] | None = None
    points: int = POINTS
    shortest: float = 0.0
    longest: float = math.inf
    integrals: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if sum(map(bool, (self.start, self.during, self.table))) != 1:
            raise LinkwiseError("[cycles] needs one of 'start', 'during' and 'table'")
        if not 0 <= self.shortest < self.longest:
            limits = f"'shortest' is {self.shortest:g} and 'longest' {self.longest:g}"
            raise LinkwiseError(f"[cycles]: {limits}; give seconds, the longest the larger")
        if not 2 <= self.points <= 10_001:
            raise LinkwiseError(f"[cycles]: 'points' is {self.points}; give 2 to 10001")
        told = set(self.start or self.during)
        if told and told != (set(SIDES) if self.sides else {""}):
            raise LinkwiseError(
                "[cycles]: give 'start' or 'during' as one text, or with 'sides' as { right = …, left = … }"
            )
        if self.turned is not None and not self.sides:
            raise LinkwiseError("[cycles]: 'turned' goes with 'sides'; add sides = \"apart\" or \"pooled\"")
        for what in (self.start or self.during).values():
            Phase.of(f"cycle={what}")

    def what(self, side: str) -> str:
        """Return the condition that defines when a cycle of a side is; empty with a table."""
        return (self.start or self.during).get(side, "")


@dataclass(frozen=True)
class Comparison:
    """Two levels of a factor that are compared by statistics, in these columns.

    `correct` says how p is corrected for the number of columns: of this comparison, or of all that have the
    same `family`.
    """

    factor: str
    between: tuple[str, ...]
    columns: tuple[str, ...]
    paired: bool = True
    alpha: float = 0.05
    correct: Correction = "none"
    family: str = ""

    def __post_init__(self) -> None:
        if len(self.between) != 2 or len(set(self.between)) != 2:
            raise LinkwiseError(f"[[compare]]: 'between' is {list(self.between)}; give two levels")
        if not self.columns:
            raise LinkwiseError("[[compare]]: 'columns' is empty; name one or more")
        if not 0 < self.alpha < 1:
            raise LinkwiseError(f"[[compare]]: 'alpha' is {self.alpha:g}; give a number between 0 and 1")


@dataclass(frozen=True)
class PaperFigure:
    """A figure of mean curves with bands for each level of a factor; causes:JOINT is of what loads a joint.

    `band` is what is filled, between subjects; `hatched` the deviation by what is uncertain, where there is
    one: within a trial, of the mean, or of the truth of a new subject. `title` stands above all panels,
    `names` has other words for columns and levels, `order` the levels that come first. `size` is the width,
    as 120 mm, or that of one or two columns of a journal, single or double; `unit` the unit of all panels,
    where theirs can become it.
    """

    columns: tuple[str, ...]
    by: str = ""
    name: str = ""
    band: Literal["deviation", "range", "none"] = "deviation"
    hatched: Literal["within", "mean", "new", "none"] = "within"
    title: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    size: str = ""
    unit: str = ""
    formats: tuple[FigureFormat, ...] = ("svg", "pdf")

    def __post_init__(self) -> None:
        if not self.columns:
            raise LinkwiseError("[[figure]]: 'columns' is empty; name one or more")
        if self.name.startswith(".") or {"/", "\\"} & set(self.name):
            raise LinkwiseError(
                f"[[figure]]: 'name' is {self.name!r}; give a name of a file, without / and \\, and no"
                " dot in front"
            )
        if not self.formats:
            raise LinkwiseError("[[figure]]: 'formats' is empty; name one or more")
        if self.order and not self.by:
            raise LinkwiseError("[[figure]]: 'order' is of levels, and goes with 'by'; add it")
        if self.size and not 40 <= (self.width or 0.0) <= 500:
            raise LinkwiseError(
                f"[[figure]]: 'size' is {self.size!r}; give single or double, or a width of 40 to 500 mm, as"
                " 120 mm"
            )
        if self.joints and self.hatched in ("mean", "new"):
            raise LinkwiseError(
                f"[[figure]]: 'hatched' is {self.hatched!r}, and figures of causes have no hatched bands;"
                f" draw columns such as {self.patterns[0]!r}, or leave it out"
            )
        if 0 < len(self.joints) < len(self.columns):
            raise LinkwiseError(
                f"[[figure]]: 'columns' has {CAUSES}{self.joints[0]} beside others; draw causes in a figure"
                " of their own"
            )

    @property
    def width(self) -> float | None:
        """Width in mm; None where it follows from the panels, or `size` has none."""
        number = WIDTHS.get(self.size, self.size).removesuffix("mm").strip()
        return float(number) if number.replace(".", "", 1).isdecimal() else None

    def named(self, text: str) -> str:
        """Return what a column, a level or a joint is called."""
        return self.names.get(text, text)

    def in_order(self, levels: Iterable[str]) -> list[str]:
        """Return levels, those first that `order` names; raise LinkwiseError where it names others."""
        there = list(dict.fromkeys(levels))
        if odd := [level for level in self.order if level not in there]:
            known = listed(map(repr, there))
            raise LinkwiseError(f"[[figure]]: 'order' has {odd[0]!r}, which no trial is; there are {known}")
        return list(dict.fromkeys((*self.order, *there)))

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose causes are drawn; none in a figure of columns."""
        return tuple(one.removeprefix(CAUSES) for one in self.columns if one.startswith(CAUSES))

    @property
    def patterns(self) -> tuple[str, ...]:
        """Patterns of the columns that it is drawn of."""
        return tuple(f"{NET}/{column_part(joint)}/*" for joint in self.joints) or self.columns

    @property
    def wholes(self) -> tuple[str, ...]:
        """Columns of the torques on the joints whose causes are drawn."""
        return tuple(f"tau/{column_part(joint)}" for joint in self.joints)


@dataclass(frozen=True)
class Trial:
    """One recording: its name, labels by factor, files, and the choices for it alone."""

    name: str
    labels: tuple[tuple[str, str], ...]
    """Label of every factor, the subject first."""
    log: str
    robot: str
    choices: AnalysisChoices = field(default_factory=AnalysisChoices)
    """Choices of the analysis, with the paths of its loads as they are opened."""
    side: str = ""
    """Side whose cycles it has, empty where cycles are of none."""
    recording: str = ""
    """Name by which a table of cycles has it."""

    def label(self, factor: str) -> str:
        """Return the trial's level of a factor."""
        return dict(self.labels)[factor]


@dataclass(frozen=True)
class StudyPlan:
    """A study whose file has been read and checked."""

    name: str
    file: Path
    factors: tuple[str, ...]
    """Names of the factors, the subject first."""
    trials: tuple[Trial, ...]
    options: Options = field(default_factory=Options)
    cycles: Cycles | None = None
    columns: tuple[str, ...] = ("**",)
    """Patterns of the columns that tables keep."""
    comparisons: tuple[Comparison, ...] = ()
    figures: tuple[PaperFigure, ...] = ()
    normalise: Normalise = ""
    """Size by which torques, forces, powers and works of all trials are divided; not said if empty."""
    bodies: Mapping[str, SubjectSize] = field(default_factory=dict)
    """Mass and height by subject, as far as the study tells them."""
    pages: bool = field(kw_only=True)
    trust_python: bool = field(kw_only=True, repr=False)
    """True if robots that are Python files are run; no result depends on it."""

    @property
    def nets(self) -> tuple[str, ...]:
        """Patterns of net torques by cause that tables, tests, figures or integrals are of, each once.

        Trials compute them by the robot's own names: in a study of both sides, any name fits where one has
        `ipsi` or `contra`.
        """
        every = [*self.columns, *(() if self.cycles is None else self.cycles.integrals)]
        every += [one for some in self.comparisons for one in some.columns]
        every += [one for figure in self.figures for one in figure.patterns]
        nets = [one for one in every if one.removeprefix("sd/").startswith(NET)]
        if self.cycles is not None and self.cycles.sides:
            nets = [OF_EITHER.sub("*", one) for one in nets]
        return tuple(dict.fromkeys(nets))
