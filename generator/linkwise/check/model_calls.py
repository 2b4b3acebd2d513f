"""Checks of every public call of a back end, and of its recorded graphs, against the reference."""

from collections.abc import Iterator
from typing import Any, NamedTuple, cast

import numpy as np
from linkwise_runtime.dynamics import Dynamics

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, IndexRows, Result, compare, dense, packed, skipped
from linkwise.extras import extra
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

FLOAT32 = {"tolerance": 1e-5, "epsilon": 2.0**-23}
"""Accuracy that is asked of single precision."""
FEW_LINKS = 8
TOO_LARGE = "the numbers are too large for it, or too small, at every state"


class Named(NamedTuple):
    """A back end's name and model, the packed layout that its package must have, and the reference."""

    name: str
    model: Dynamics
    rows: IndexRows
    reference: Reference


def against_reference(checked: Named, manifest: Manifest) -> Iterator[Result]:
    """Yield checks of every quantity and call, batches of all shapes, single precision, and structure."""
    name, model, rows, reference = checked
    states = reference.states
    yield _layout(checked)
    every, told = np.arange(len(states.q)), f"against {reference.name}"
    for what, value in rows.fields(model.packed(*states.motion)).items():
        shown = {"tau": "tau_ij", "c2": "M^j"}.get(what, what)
        entries = packed(what, value, rows.of(what), reference, every)
        yield compare(f"{name}: {shown} {told}", [entries], reference.tolerance)
    slopes = dense("c0", model.position_gradient(*states.motion), reference)
    yield compare(f"{name}: c0 {told}", [slopes], reference.tolerance)
    yield compare(f"{name}: all calls agree with these", _calls(checked), reference.tolerance)
    yield compare(f"{name}: single samples and odd batches", _batches(checked), reference.tolerance)
    if reference.fits_single().any():
        yield compare(f"{name}: single precision", _single(checked), **FLOAT32)
    else:
        yield skipped(f"{name}: single precision", TOO_LARGE)
    if hasattr(model.backend, "modules"):
        yield from _energies(checked)
    yield from _structure(checked, manifest)


def _layout(checked: Named) -> Result:
    rows = checked.rows
    pairs = [
        (rows.c2, checked.model.layout.acceleration),
        (rows.c1, checked.model.layout.velocity),
        (rows.tau, checked.model.layout.gravity),
        (rows.tau, checked.model.layout.torque),
    ]
    same = all(np.array_equal(expected, found) for expected, found in pairs)
    paths = [tuple(rows.tau[rows.tau[:, 1] == j, 0]) for j in range(len(checked.model.link_names))]
    forms = [link.PATH for link in getattr(checked.model.backend, "links", ())]
    same = same and (not forms or forms == paths)
    detail = "as the manifest's paths say" if same else "not that of the manifest's paths"
    return Result(f"{checked.name}: layout of packed values", same, None, detail)


def _calls(checked: Named) -> Iterator[Entries]:
    """Yield entries of the dense calls, masks, sums and both conventions."""
    _, model, rows, reference = checked
    q, qd, qdd = reference.states.motion
    values, scales = reference.values, reference.scales
    yield packed("tau", model.packed_torque(q, qd, qdd), rows.tau, reference, np.arange(len(q)))
    yield dense("tau", model.partial_torque(q, qd, qdd), reference)
    sums = Entries("tau_i", model.inverse_dynamics(q, qd, qdd), values["tau"].sum(-1), scales["tau"].sum(-1))
    yield sums
    coefficients = model.coefficients(q, qd)
    for what, value in zip(("c2", "c1", "g"), coefficients, strict=True):
        yield dense(what, value, reference)
    if "shares" in values:
        yield dense("shares", model.named_shares(q, qd), reference)
    most = [np.abs(x) for x in (q, qd, qdd)]
    slopes = {"closing": values["c1"], "gradient": 2 * values["c1"] - values["h1"]}
    calls: Any = model
    for convention, c1 in slopes.items():
        parts = calls.propagation(q, qd, qdd, convention=convention)
        yield Entries("c2 qdd", parts[0], values["c2"] * _over(qdd), scales["c2"] * _over(most[2]))
        scale = 2 * scales["c1"] * _over(most[1])
        yield Entries(f"c1 qd ({convention})", parts[1], c1 * _over(qd), scale)
        yield dense("g", parts[2], reference)
        if convention == "closing":
            closed = parts[0].sum(-1) + parts[1].sum(-1) + parts[2]
            yield Entries("sum of propagation torques", closed, values["tau"], scales["tau"])
    mask = np.random.default_rng(1).uniform(0.5, 1.5, (3, q.shape[1]))
    for weights in (mask, mask * [[0.0], [1.0], [1.0]]):
        orders = list(zip(("c0", "c1", "c2"), weights, (q, qd, qdd), most, strict=True))
        expected = np.sum([(values[c] @ _column(w * x))[..., 0] for c, w, x, _ in orders], axis=0)
        scale = np.sum([(scales[c] @ _column(w * m))[..., 0] for c, w, _, m in orders], axis=0)
        yield Entries("masked", model.masked(q, qd, qdd, weights), expected, scale)


def _batches(checked: Named) -> Iterator[Entries]:
    """Yield one sample, batches that fill no block, of two axes or no samples, and a q that samples share."""
    reference = checked.reference
    states, count = reference.states, len(reference.states.q)
    if not count:
        return
    for shape in ((), (2, 3)) if reference.is_large else ((), (1,), (7,), (9,), (17,), (2, 3), (0,)):
        at = np.arange(int(np.prod(shape))).reshape(shape) * 5 % count
        yield from _few(checked, states.at(at), at)
    same = np.zeros(5, dtype=int)
    alike = States(states.q[0], states.qd[same], states.qdd[:1])
    yield from _few(checked, alike, same)


def _few(checked: Named, states: States, at: Index) -> Iterator[Entries]:
    _, model, rows, reference = checked
    for what, value in rows.fields(model.packed(*states.motion)).items():
        yield packed(what, value, rows.of(what), reference, at)
    if at.size in (1, 7, 6):
        yield _flat("c0", model.position_gradient(*states.motion), reference, at)
    yield _flat("tau", model.partial_torque(*states.motion), reference, at)


def _flat(what: str, value: Array, reference: Reference, at: Index) -> Entries:
    """Return entries whose batch of shape `at` is flattened to one axis."""
    inner = reference.values[what].shape[1:]
    if value.shape != (*at.shape, *inner):
        shape = np.empty((*at.shape, *inner))
        return Entries(what, value, shape, shape)
    return dense(what, value.reshape(-1, *inner), reference, at.reshape(-1))


def _single(checked: Named) -> Iterator[Entries]:
    """Yield packed values, torques and c0 in float32, of a large batch and of ones that fill no block."""
    _, model, rows, reference = checked
    fitting = np.flatnonzero(reference.fits_single())
    for at in (fitting,) if reference.is_large else (fitting, fitting[:7], fitting[:1]):
        motion: list[Any] = [x[at].astype(np.float32) for x in reference.states.motion]
        for what, value in rows.fields(model.packed(*motion)).items():
            yield packed(what, value, rows.of(what), reference, at)
        yield packed("tau", model.packed_torque(*motion), rows.tau, reference, at)
        yield dense("c0", model.position_gradient(*motion), reference, at)


def _energies(checked: Named) -> Iterator[Result]:
    """Yield checks of each module's Lagrangian against kinetic less potential energy."""
    name, model, _, reference = checked
    if reference.lagrangian is None:
        return
    expected, scale = reference.lagrangian
    value = _lagrangians(model, reference.states)
    entries = Entries("L", value, expected, scale)
    yield compare(f"{name}: Lagrangians against the energies", [entries], reference.tolerance)
    yield compare(f"{name}: each link by itself", _links(checked), reference.tolerance)


def _links(checked: Named) -> Iterator[Entries]:
    """Yield each module's values for its own link; of a large robot the first, which fewer joints carry."""
    torch, reference = extra("torch"), checked.reference
    backend: Any = checked.model.backend
    modules = list(backend.modules)[: FEW_LINKS if reference.is_large else None]
    motion = [torch.from_numpy(x) for x in reference.states.motion]
    parts = [module.coefficients(*motion[:2]) for module in modules]
    values = dict(zip(("c2", "c1", "g"), zip(*parts, strict=True), strict=True))
    for what, rows in (values | {"tau": [module.torque(*motion) for module in modules]}).items():
        found = np.stack([row.detach().numpy() for row in rows], 2)
        value, scale = (source[what][:, :, : len(modules)] for source in (reference.values, reference.scales))
        yield Entries(what, found, value, scale)


def _lagrangians(model: Dynamics, states: States) -> Array:
    torch, backend = extra("torch"), cast(Any, model.backend)
    motion = [torch.from_numpy(x) for x in (states.q, states.qd)]
    return np.stack([module(*motion).detach().numpy() for module in backend.modules], -1)


def _structure(checked: Named, manifest: Manifest) -> Iterator[Result]:
    """Yield checks of zeros off the path, and of the mass matrix, which no other check sees as a whole.

    Off the path not even rounding may be left. A user's energies, and bodies allowed to be unphysical, may
    have any mass matrix: there it is only reported.
    """
    name, model, rows, reference = checked
    q, qd, qdd = reference.states.motion
    tau = model.partial_torque(q, qd, qdd)
    off = np.ones(tau.shape[1:], dtype=bool)
    off[tuple(rows.tau.T)] = False
    error = float(np.abs(tau[:, off]).max(initial=0.0))
    yield Result(f"{name}: tau_ij = 0 off the path", error == 0.0, error, f"largest value {error:.1e}")
    mass = np.asarray(model.coefficients(q, qd).acceleration).sum(2)  # of degree three it has velocities, too
    # Scaled to a diagonal of ones, so that a hand's inertia is not lost beside a body's.
    diagonal = np.einsum("sii->si", mass)
    size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = mass / (size[:, :, None] * size[:, None, :])
    smallest = float(np.linalg.eigvalsh(scaled).min(initial=np.inf))
    unphysical = bool(manifest.request.get("allow_unphysical")) or manifest.tree is None
    check, detail = (
        f"{name}: total mass matrix positive definite",
        f"smallest eigenvalue, scaled, {smallest:.1e}",
    )
    if smallest <= 0 and unphysical:
        yield skipped(check, f"it is not, which is allowed here: {detail}")
    else:
        yield Result(check, smallest > 0, smallest, detail)


def _over(motion: Array) -> Array:
    """Return motion (samples, n) as (samples, 1, 1, n), beside coefficients (samples, n, N, n)."""
    return motion[:, None, None, :]


def _column(motion: Array) -> Array:
    """Return motion (samples, n) as columns to multiply with coefficients (samples, n, N, n)."""
    return motion[:, None, :, None]


RECORDED_STATES = 10
"""Most states that recorded graphs are run at."""
PAIRS = 6
"""Most torques tau_ij: each is recorded anew."""
CARRIERS = 16
"""Most joints that carry the link of a recorded torque, in a large robot."""
OPERATIONS = 2500
"""Most operations run in all: where there are more, every tau_ij has its share, by parts picked at random."""


def recorded_parts(checked: Named) -> Result:
    """Compare c2_ijk qdd_k, c1_ijk qd_k and g_ij with the reference, each from its graph, zero without."""
    reference = checked.reference
    return compare(
        f"{checked.name}: graphs of parts of tau_ij against {reference.name}",
        _parts(checked),
        reference.tolerance,
    )


def _parts(checked: Named) -> Iterator[Entries]:
    reference, joints = checked.reference, list(checked.model.joint_names)
    few = reference.states.at(slice(RECORDED_STATES))
    generator, run = np.random.default_rng(0), 0
    asked = [(None, 0), *((k, m) for k in range(len(joints)) for m in (1, 2))]
    # Recording a torque takes longer, the more joints carry the link.
    carriers = np.bincount(checked.rows.tau[:, 1])
    most = max(CARRIERS, carriers.min()) if reference.is_large else carriers.max()
    near = checked.rows.tau[carriers[checked.rows.tau[:, 1]] <= most]
    pairs = generator.permutation(near)[:PAIRS].tolist()
    backend: Any = checked.model.backend
    for i, j in pairs:
        graphs = {(part.coordinate, part.order): part for part in backend.graph_parts(i, j)}
        own = 0
        for k, m in (asked[at] for at in generator.permutation(len(asked))):
            found, graph = np.zeros(len(few.q)), graphs.get((None if k is None else joints[k], m))
            if graph is not None:
                if max(own * len(pairs), run) > OPERATIONS:
                    continue
                found = graph.evaluate(*few.motion).detach().numpy()
                own, run = own + len(graph.operations), run + len(graph.operations)
            yield _part(reference, (i, j, k), m, found)


def _part(reference: Reference, at: tuple[int, int, int | None], m: int, found: Array) -> Entries:
    """Return a part of order m beside its value in the reference."""
    i, j, k = at
    place = (i, j) if k is None else (i, j, k)
    row = (slice(len(found)), *place)
    motion = np.ones(len(found)) if k is None else reference.states.motion[m][: len(found), k]
    what = ("g", "c1", "c2")[m]
    return Entries(
        f"{what}({', '.join(str(index + 1) for index in place)})",
        found,
        reference.values[what][row] * motion,
        reference.scales[what][row] * np.abs(motion),
    )
