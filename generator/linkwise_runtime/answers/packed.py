"""Packed values of back ends, with the operations that answers need, and tables to spread and sum them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..interface import Dtype, Library, Namespace, Numbers, TableKind
from ..quantities import PARAMETERS
from ..structure import Indices, Layout, Structure

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]


class OneSample(Protocol):
    """Functions of a back end for one sample, beside those for many."""

    def answer(
        self, call: str, motion: Sequence[Numbers], frame: int | None = None, point: Numbers | None = None
    ) -> Numbers | None:
        """Return the answer to a motion (..., n), for a frame and a point (..., 3) of it if given.

        It is None for anything but one sample, and for calls that the function does not answer.
        """


class TorqueOfOne(Protocol):
    """A controller's torque for one sample, which a back end has beside that for many."""

    def torque(self, given: Mapping[str, Numbers]) -> Numbers | None:
        """Return the torque (n,) for motion and targets by name; None where the function has no answer."""

    def acceleration(self, given: Mapping[str, Numbers]) -> Numbers | None:
        """Return the acceleration (n,) that follows, likewise."""

    def forces(self, given: Mapping[str, Numbers]) -> Numbers | None:
        """Return the forces of ties and contacts (C,) that follow, likewise."""


class TiedFunctions(Protocol):
    """Functions of a back end for joints that are tied, with constraints and independent joints as chosen."""

    def at_once(self, call: str, motion: Sequence[object]) -> Sequence[Numbers] | None:
        """Return the answer for one plain sample of a call made before; None for anything else."""

    def answer(
        self, call: str, motion: Sequence[Numbers], held_at: Numbers | None = None
    ) -> Sequence[Numbers] | None:
        """Return the answer for motion (..., n), with contacts as they took hold; None where there is none.

        There is none where ties are open or singular, say: the operations on arrays then say what is wrong.
        """

    def controller(
        self,
        targets: object,
        frame: object,
        driven: Sequence[int],
        weight: NDArray[np.float64],
        undriven: int,
    ) -> TorqueOfOne:
        """Return functions for one sample, for targets of joints and of a frame, and for driven joints."""


class AskedMotion(NamedTuple):
    """Motion over time that is to be computed by a back end's own functions, in steps of RK4."""

    q: Numbers
    """Positions at the start, (..., n)."""
    qd: Numbers
    """Velocities there, (..., n)."""
    times: Sequence[float]
    """Instants, ascending, in s."""
    step: float | None
    """Longest step, in s; None for one from instant to instant."""
    tau: Numbers | Callable[[float, Numbers, Numbers], Numbers]
    """Torques (..., n), or a function that gives them, or the robot's `CController`."""
    passive: bool
    """True if what joints have of their own counts."""
    ties: TiedFunctions | None
    """Functions of the constraints; None where nothing ties the joints."""


class ReachedMotion(NamedTuple):
    """Instants of such a motion that were reached, T or fewer."""

    q: Numbers
    """Positions, (T, ..., n)."""
    qd: Numbers
    """Velocities, (T, ..., n)."""
    tau: Numbers
    """Torques, (T, ..., n)."""
    work: Numbers
    """Work since the start, (T, ...), in J."""


class PackedBackend(Library):
    """Base of back ends: packed values (..., count) in the order of `Layout`, for motion (..., n)."""

    name: ClassVar[str]
    """Name of the back end, as `load` accepts it."""
    xp: ClassVar[Namespace]
    structure: Structure
    """Names, paths and parameters."""
    examples: Sequence[Numbers] = ()
    """Empty arrays of kinds for which tables are made in advance, so that no compiler traces how they are
    made."""

    @property
    def samples(self) -> tuple[int, ...]:
        """Shape of the samples that have a parameter or a body each; () where all samples share them."""
        raise NotImplementedError

    regresses: bool
    """True if the back end has regressors, which come from the rule of rigid links."""
    one_sample: OneSample | None = None
    """Functions for one sample; None without any."""

    def tied_functions(self, chosen: object, tolerance: float | None) -> TiedFunctions | None:
        """Return functions for constraints that have been chosen; None without any.

        tolerance: how far ties may be open, as `Dynamics.constrained` says
        """
        return None

    def moved(self, asked: AskedMotion) -> ReachedMotion | None:
        """Return a motion over time as far as functions of the back end's own get; None without any."""
        return None

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau and h1, (..., count) each."""
        raise NotImplementedError

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count), in the order of `Layout.torque`."""
        raise NotImplementedError

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count), in the order of `Layout.velocity`."""
        raise NotImplementedError

    def energies(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return the kinetic and potential energies of the links in J, (..., N) each."""
        raise NotImplementedError

    def power_beside(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return R_j, the power that links written by hand get otherwise than from joints, in W, (..., N)."""
        raise NotImplementedError

    def named_shares(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return shares of links written by hand, (..., count), in the order of `Structure.share_rows`."""
        raise NotImplementedError

    def regressor(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return the rows of 10 of tau, flat: (..., 10 count)."""
        raise NotImplementedError

    def coefficient_regressors(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return the rows of 10 of c2, c1 and g, flat: (..., 10 count) each."""
        raise NotImplementedError

    def share_variances(
        self, q: Numbers, qd: Numbers, qdd: Numbers, factors: ArrayLike
    ) -> Sequence[Numbers] | None:
        """Return the variances of c2, c1, g and tau, (S, count) each, where what links carry is uncertain.

        None where a back end has no more than the regressors that they follow from.

        factors: F (N, 10, 10), with F F^T the covariance of the inertial parameters of each link
        """
        return None

    def motion_variances(
        self, motion: Sequence[Numbers], roots: ArrayLike, names: Sequence[str]
    ) -> Mapping[str, Numbers] | None:
        """Return variances where q, qd and qdd (S, n) are uncertain, by name, (entries, S) each.

        None where a back end has no more than the shares that are perturbed.

        roots: D (S or 1, 3 n, R), with D D^T the covariance of q, qd and qdd, one after the other
        names: which are wanted, of those that `certainty.motion_variances` lists
        """
        return None

    def product(self, a: Numbers, b: Numbers) -> Numbers:
        """Return the matrix products (..., l, n) of arrays (..., l, m) and (..., m, n)."""
        return a @ b

    def read_beside_motion(self) -> Iterable[object]:
        """Return the arrays or tensors, beside the motion, that results depend on."""
        raise NotImplementedError


class SumTable(NamedTuple):
    """Packed values that a matrix of joints sums up: first those of its first entry, row by row."""

    values: Numbers
    """Positions of the summands."""
    entries: Numbers
    """Flat index of the matrix entry to which each of them belongs."""
    starts: Numbers
    """Places where the summands begin of each entry that has any."""
    filled: Numbers
    """Flat indices of these entries."""


class PackedTables:
    """Tables of constants, for each device, by which packed values of one robot are spread and summed."""

    def __init__(self, backend: PackedBackend) -> None:
        structure = backend.structure
        self._backend, self._layout, self._n = backend, structure.layout, structure.n
        over = (structure.n, structure.N)
        self._rows: dict[str, Indices] = structure.layout._asdict()
        self._shapes = {
            "acceleration": (*over, structure.n),
            "velocity": (*over, structure.n),
            "velocity_excess": (*over, structure.n),
            "gravity": over,
            "torque": over,
        }
        if structure.shares:
            self._shapes["shares"] = (*over, len(structure.share_names))
            self._rows["shares"] = structure.share_rows
        self._places: dict[object, Numbers] = {}
        self._sums: dict[object, SumTable] = {}
        for like in backend.examples:
            for field in self._shapes:
                packed_table(self, field, _device(like))
            for field in ("acceleration", "velocity"):
                packed_sums(self, field, _device(like))
            packed_joint_sums(self, like.dtype, _device(like))

    def spread(self, values: Numbers, field: str) -> Numbers:
        """Return a field of `Layout` (..., count) as (..., n, N) or (..., n, N, n), zeros elsewhere."""
        table, batch = packed_table(self, field, _device(values)), values.shape[:-1]
        if isinstance(values, np.ndarray):
            padded = np.zeros((*batch, values.shape[-1] + 1), values.dtype)
            padded[..., :-1] = values
            placed: NDArray[np.floating] = padded.take(cast(Indices, table), -1)
            return placed.reshape(*batch, *self._shapes[field])
        entries = self._backend.concatenate([values, self._backend.zeros(values, 1)])[..., table]
        dense: Numbers = entries.reshape(*batch, *self._shapes[field])
        return dense

    def spread_rows(self, values: Numbers, field: str) -> Numbers:
        """Return rows of 10 (..., 10 count) of a field in (..., n, N[, n], 10), zeros elsewhere."""
        padded = self._backend.concatenate([values, self._backend.zeros(values, PARAMETERS)])
        rows = padded.reshape(*values.shape[:-1], len(getattr(self._layout, field)) + 1, PARAMETERS)
        entries = rows[..., packed_table(self, field, _device(values)), :]
        dense: Numbers = entries.reshape(*values.shape[:-1], *self._shapes[field], PARAMETERS)
        return dense

    def sum_over_links(self, tau: Numbers) -> Numbers:
        """Return packed torques (..., count) summed over the links, (..., n)."""
        return tau @ packed_joint_sums(self, tau.dtype, _device(tau))

    def matrices(self, values: Numbers, field: str) -> Numbers:
        """Return the sums sum_j c_ijk (..., n, n) of values (..., count) of a field with rows (i, j, k)."""
        # Any: a table of arrays or of tensors, as the values are.
        table: Any = packed_sums(self, field, _device(values))
        size = self._n * self._n
        sums = self._backend.zeros(values, size)
        if not isinstance(values, np.ndarray):
            chosen = cast("Tensor", values).index_select(-1, table.values)
            sums = cast("Tensor", sums).index_add(-1, table.entries, chosen)
        elif len(table.starts):
            found = np.add.reduceat(values.take(table.values, -1), table.starts, -1)
            if len(table.starts) == size:
                sums = found
            else:
                sums[..., table.filled] = found
        matrices: Numbers = sums.reshape(*values.shape[:-1], self._n, self._n)
        return matrices

    def _positions(self, field: str) -> Indices:
        """Return for each entry of the dense tensor its packed position, or that of the zero behind."""
        rows = self._rows[field]
        positions = np.full(self._shapes[field], len(rows), dtype=np.intp)
        positions[tuple(rows.T)] = np.arange(len(rows))
        if field == "acceleration":
            positions[rows[:, 2], rows[:, 1], rows[:, 0]] = np.arange(len(rows))
        return positions.reshape(-1)


def packed_table(tables: PackedTables, field: str, device: object) -> Numbers:
    """Return the packed position of each dense entry of a field.

    As the two functions below, it makes tables when first asked for; compilers take them as they are, and do
    not follow this.
    """
    key = field, device
    if key not in tables._places:
        tables._places[key] = tables._backend.index(tables._positions(field), _like(None, device))
    return tables._places[key]


def packed_joint_sums(tables: PackedTables, dtype: Dtype, device: object) -> Numbers:
    """Return zeros (count, n), with ones where a packed torque is on a joint."""
    key = dtype, device
    if key not in tables._places:
        rows = tables._layout.torque
        sums = np.zeros((len(rows), tables._n))
        sums[np.arange(len(rows)), rows[:, 0]] = 1.0
        tables._places[key] = tables._backend.constant(sums, _like(dtype, device))
    return tables._places[key]


def packed_sums(tables: PackedTables, field: str, device: object) -> SumTable:
    """Return the positions by which a field is summed over the links."""
    key = field, device
    if key not in tables._sums:
        listed = sum_table(tables._layout, field, tables._n)
        tables._sums[key] = SumTable(*(tables._backend.index(a, _like(None, device)) for a in listed))
    return tables._sums[key]


def _device(values: Numbers) -> object:
    return getattr(values, "device", None)


def _like(dtype: Dtype | None, device: object) -> Numbers:
    return cast("Numbers", TableKind(dtype, device))


def sum_table(layout: Layout, field: str, n: int) -> tuple[NDArray[np.intp], ...]:
    """Return the fields of the `SumTable` of a field; for c2, listed for i <= k, with the other half too."""
    rows: Indices = getattr(layout, field)
    i, k = rows[:, 0], rows[:, 2]
    values, entries = np.arange(len(rows)), i * n + k
    if field == "acceleration":
        values, entries = np.append(values, values[i < k]), np.append(entries, (k * n + i)[i < k])
    order = np.argsort(entries, kind="stable")
    filled, starts = np.unique(entries[order], return_index=True)
    return values[order], entries[order], starts, filled
