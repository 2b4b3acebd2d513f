"""Bodies whose masses, centres and radii of gyration are uncertain: exact covariance of what links carry.

Link j carries pi_j, its inertial parameters, with c its centre and r_x its radii about that,

    pi_j = f_j p_j    p = (m, m c, I)    I = m (sum_x r_x^2 e_x e_x^T + c . c 1 - c c^T)

Principal axes e_x stay as they are. Errors of masses f_j m_j, centres and radii are normal and independent of
each other, but that masses of links may go together: f_j = (1 + e) (1 + e_j), with e the error of a body mass
of which segments have fixed parts, and e_j those of the parts. So for all pairs of links

    cov(pi_j, pi_l) = E[f_j f_l] E[p_j p_l^T] - E[f_j] E[f_l] E[p_j] E[p_l]^T
                    = cov(f_j, f_l) E[p_j] E[p_l]^T + (j = l) E[f_j^2] cov(p_j)

which is exact: moments of normals are polynomials. The mean of pi_j is not quite pi_j at the means, but more
by m (tr P 1 - P + sum_x var(r_x) e_x e_x^T) in its inertia, P being the covariance of the centre.

Any other covariance of all pi together, such as that of identified ones, may come on top.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..chosen_names import short
from ..quantities import PARAMETERS
from ..rule.joint_tree import JointTree
from ..rule.tree_arrays import SHAPES, formula_sources, given_numbers, own_numbers
from .parameter_moments import ROUNDING, Floats, factor, parameter_moments, principal_moments


class UncertainBodies(NamedTuple):
    """Standard deviations of what links carry, N links in the order of j; 0 for what is certain."""

    masses: ArrayLike = 0.0
    """Deviation of each link's mass, as a part of it: 0.1 for 10 %; (N,) or one number for all."""
    centres: ArrayLike = 0.0
    """Deviation of centres of mass in m: (N, 3) along x, y, z of the body in its file, or one number for all;
    or covariances in these axes in m^2, (N, 3, 3)."""
    radii: ArrayLike = 0.0
    """Deviation of each of the three radii of gyration about the centre, as a part of it; (N,) or one."""
    body_mass: float = 0.0
    """Deviation of a body mass of which links have fixed parts, as a part of it."""
    segments: ArrayLike = 1.0
    """Ones for the links that have parts of that mass, zeros for others; (N,)."""
    correlation: ArrayLike | None = None
    """Correlation of the links' own errors of mass, (N, N); none unless given."""
    lengths: ArrayLike = 0.0
    """Deviation of the places of the tree's joints in m: (F, 3) along x, y, z of the body in its file that
    carries the joint, or one number for all; or covariances, (F, 3, 3). They count to first order."""
    parameters: ArrayLike | None = None
    """Covariance of all links' inertial parameters, those of `regressor`, (10 N, 10 N), or a factor H of it,
    (N, 10, Q), with H H^T that covariance; on top of what the others say, and independent of it."""


class BodySpread(NamedTuple):
    """Covariance of inertial parameters: cov(pi_j, pi_l) = H_j H_l^T + (j = l) F_j F_j^T."""

    own: Floats
    """F_j, what differs by each link for itself, (N, 10, R)."""
    shared: Floats
    """H_j, what links have in common, (N, 10, Q); no columns where each differs by itself."""

    @property
    def by_link(self) -> Floats:
        """Factors of each link's own covariance, (N, 10, up to 10): of H_j H_j^T + F_j F_j^T."""
        if not self.shared.shape[-1]:
            return self.own
        # By QR, as squares would lose what torques tell well beside what they do not.
        triangles: Floats = np.asarray(np.linalg.qr(np.concatenate([self.own, self.shared], -1).mT, mode="r"))
        return triangles.mT

    @property
    def factor(self) -> Floats:
        """Factor of the covariance of all parameters, (10 N, N R + Q)."""
        count, _, columns = self.own.shape
        apart = np.zeros((count, PARAMETERS, count, columns))
        each = np.arange(count)
        apart[each, :, each] = self.own
        return np.concatenate([a.reshape(PARAMETERS * count, -1) for a in (apart, self.shared)], 1)


def body_spread(links: Sequence[str], carried: Sequence[Floats], axes: Floats, given: Any) -> BodySpread:
    """Return the spread of bodies.

    links: their names; carried: masses (N,), centres (N, 3), inertias about these (N, 3, 3), in the axes of
    their frames; axes: rotations (N, 3, 3) from the bodies' own axes to these; given: an `UncertainBodies`

    Raises ValueError, which names field and link, for what cannot be.
    """
    count, (masses, centres, inertias) = len(links), carried
    own, radii = (known_parts(links, name, getattr(given, name)) for name in ("masses", "radii"))
    places = axes @ place_covariances(links, "centres", given.centres) @ axes.mT
    part = known_parts(["body_mass"], "body_mass", given.body_mass)[0]
    segments = part * known_parts(links, "segments", given.segments)
    # cov(f_j, f_l) = segments_j segments_l + errors_jl
    together = checked_correlation(links, given.correlation)
    errors = (1.0 + np.outer(segments, segments)) * together * np.outer(own, own)
    sizes = np.sqrt(1.0 + segments**2 + np.diag(errors))
    found = [
        parameter_moments(
            masses[j], centres[j], places[j], *principal_moments(inertias[j], axes[j]), radii[j]
        )
        for j in range(count)
    ]
    means = np.array([mean for mean, _ in found])
    alone = np.count_nonzero(errors - np.diag(np.diag(errors)), axis=1) == 0
    apart = [
        np.hstack(
            [sizes[j] * factor(cov), means[j, :, None] * factor(errors[j : j + 1, j : j + 1] * alone[j])]
        )
        for j, (_, cov) in enumerate(found)
    ]
    widest = max(f.shape[1] for f in apart)
    padded = [np.pad(f, ((0, 0), (0, widest - f.shape[1]))) for f in apart]
    common = np.hstack([segments[:, None], factor(np.where(alone, 0.0, errors))])
    common = common[:, common.any(0)]
    shared = [means[:, :, None] * common[:, None, :], parameter_factor(links, given.parameters)]
    return BodySpread(np.array(padded), np.concatenate(shared, -1))


def tree_bodies(
    tree: JointTree, parameters: Mapping[str, Any], bodies: Sequence[Any] | None
) -> tuple[Floats, Floats, Floats]:
    """Return the masses (N,), centres (N, 3) and inertias (N, 3, 3) that a robot's links carry.

    Raises ValueError where they differ from sample to sample, which a spread cannot.
    """
    plain = {name: _plain(value) for name, value in parameters.items()}
    own = [_plain(a) for a in bodies] if bodies is not None else None
    axes = (
        []
        if own is None
        else [a.ndim - 1 - len(shape) for a, shape in zip(own, SHAPES.values(), strict=True)]
    )
    for name, more in (*((n, v.ndim) for n, v in plain.items()), *(("bodies", more) for more in axes)):
        if more:
            raise ValueError(
                f"{short(name)} differs from sample to sample; uncertainty is of one robot's bodies"
            )
    xp: Any = np
    listed: Any = own_numbers(tree), formula_sources(tree)
    numbers: Any = given_numbers(xp, tree, listed, plain, None, ())
    if own is not None:
        return own[0], own[1], own[2]
    mass, centre, inertia = (a[..., 0] for a in numbers.bodies)
    return mass, centre.T, inertia.transpose(2, 0, 1)


def body_axes(tree: JointTree) -> Floats:
    """Return the rotations from the axes of bodies in their file to those of the links' frames, (N, 3, 3)."""
    own = {frame.name: frame.rotation for frame in tree.frames}
    return np.array([own.get(tree.link_name(j), np.eye(3)) for j in range(len(tree.links))], dtype=float)


def length_shifts(tree: JointTree, given: Any) -> Floats:
    """Return directions along which joints' places differ by one standard deviation, (D, 3, frames) in m.

    They are those of `RigidRule.translation_gradient`, and independent of each other. A joint that nothing
    turns has none: its place is that of all.

    given: `UncertainBodies.lengths`; raises as `body_spread` does
    """
    covariances = place_covariances([joint.name for joint in tree.joints], "lengths", given)
    own = {frame.name: np.array(frame.rotation) for frame in tree.frames}
    found = []
    for f, joint in enumerate(tree.joints):
        before = [tree.joints[at] for at in tree.chain(joint.parent)]
        if any(one.kind == "revolute" and one.ratio for one in before):
            axes = own.get(before[-1].link, np.eye(3))
            for column in factor(axes @ covariances[f] @ axes.T).T:
                shift = np.zeros((3, len(tree.joints) + 1))
                shift[:, f] = column
                found.append(shift)
    return np.array(found).reshape(-1, 3, len(tree.joints) + 1)


def checked_correlation(names: Sequence[str], given: Any) -> Floats:
    """Return a matrix of correlations; the unit matrix for None.

    Raises ValueError for what is not one.
    """
    count = len(names)
    if given is None:
        return np.eye(count)
    matrix = _numbers("correlation", given)
    if matrix.shape != (count, count):
        raise ValueError(f"correlation has shape {matrix.shape}; it must be {(count, count)}")
    if (np.abs(np.diag(matrix) - 1.0) > ROUNDING).any() or (np.abs(matrix - matrix.T) > ROUNDING).any():
        raise ValueError("correlation is not symmetric with ones on its diagonal; give such a matrix")
    j, l = divmod(int(np.abs(matrix).argmax()), count)
    if np.abs(matrix[j, l]) > 1.0 + ROUNDING:
        told = f"{short(names[j])} and {short(names[l])}"
        raise ValueError(f"correlation of {told} is {matrix[j, l]:g}; give one from -1 to 1")
    least = float(np.linalg.eigvalsh(matrix).min())
    if least < -ROUNDING * count:
        raise ValueError(
            f"correlation cannot be: its smallest eigenvalue is {least:.3g}, and no masses go together so; "
            "correlations of three have to agree with each other"
        )
    return matrix


def parameter_factor(links: Sequence[str], given: Any) -> Floats:
    """Return H (N, 10, Q) of `UncertainBodies.parameters`."""
    count = len(links)
    if given is None:
        return np.zeros((count, PARAMETERS, 0))
    values, size = _numbers("parameters", given), PARAMETERS * count
    if values.ndim == 3 and values.shape[:2] == (count, PARAMETERS):
        return values
    if values.shape != (size, size):
        raise ValueError(
            f"parameters has shape {values.shape}; it must be a covariance, {(size, size)}, or a factor of "
            f"it, {(count, PARAMETERS, 'Q')}"
        )
    variances = np.diag(values)
    if (variances < 0).any():
        link = short(links[int(variances.argmin()) // PARAMETERS])
        raise ValueError(f"parameters of {link} have the variance {variances.min():g}; it is 0 or more")
    scales = np.sqrt(np.where(variances > 0, variances, 1.0))
    scaled = values / np.outer(scales, scales)
    if np.abs(scaled - scaled.T).max() > ROUNDING:
        raise ValueError("parameters is not symmetric; give a covariance")
    least = float(np.linalg.eigvalsh(scaled).min())
    if least < -ROUNDING * size:
        raise ValueError(
            f"parameters is not a covariance: scaled to variances of 1 it has the eigenvalue {least:.3g}"
        )
    return factor(values).reshape(count, PARAMETERS, -1)


def place_covariances(names: Sequence[str], what: str, given: Any) -> Floats:
    """Return covariances (count, 3, 3) of places in m^2."""
    count, values = len(names), _numbers(what, given)
    if values.shape == (count, 3, 3):
        for name, matrix in zip(names, values, strict=True):
            size = np.abs(matrix).max()
            if np.abs(matrix - matrix.T).max() > ROUNDING * size or (
                np.linalg.eigvalsh(matrix).min() < -ROUNDING * size
            ):
                raise ValueError(f"{what} of {short(name)} is not a covariance; give (3,) deviations in m")
        return values
    if values.shape not in ((), (count, 3)):
        raise ValueError(
            f"{what} has shape {values.shape}; it must be {(count, 3)} or one number, in m, or covariances "
            f"{(count, 3, 3)}, in m^2"
        )
    if (values < 0).any():
        raise ValueError(f"{what} has {values.min():g}; a standard deviation is 0 or more")
    squares = np.broadcast_to(values, (count, 3)) ** 2
    return squares[:, :, None] * np.eye(3)


def known_parts(links: Sequence[str], name: str, given: Any) -> Floats:
    """Return deviations (N,), each a part of what it is of."""
    values = _numbers(name, given)
    if values.shape not in ((), (len(links),)):
        raise ValueError(f"{name} has shape {values.shape}; it must be {(len(links),)} or one number")
    every = np.broadcast_to(values, (len(links),))
    for link, value in zip(links, every, strict=True):
        if value < 0:
            raise ValueError(f"{name} of {short(link)} is {value:g}; a standard deviation is 0 or more")
    return every


def _numbers(name: str, given: Any) -> Floats:
    try:
        values = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {short(given)}; give numbers") from None
    if not np.isfinite(values).all():
        raise ValueError(f"{name} has NaN or infinity; give finite numbers")
    return values


def _plain(value: Any) -> Floats:
    """Return a number, an array or a tensor as an array, without gradients."""
    found = value.detach().cpu().numpy() if hasattr(value, "detach") else value
    return np.asarray(found, dtype=float)
