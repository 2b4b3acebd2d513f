"""Covariance of the bodies that an identification writes, about those that the robot has.

The physical fit is linear but for its cones. With S the links' sizes, B the combinations, R the triangle of
the base parameters' weighted equations, from which friction is eliminated, and R B S = U D V^T, it is

    pi' = pi0 + K (beta - B pi0)        K = S V D / (1 + D^2) U^T R

of the file's bodies pi0 and beta = B pi + e, with cov(e) = (R^T R)^-1. Where the file's bodies are off by a
covariance P, independent of the noise, those of the fit are off by (1 - K B)(pi0 - pi) + K e, so

    cov(pi') = (1 - K B) P (1 - K B)^T + K (R^T R)^-1 K^T

the form that P. Joseph gave Kalman's filter (R. Bucy, P. Joseph, Filtering for Stochastic Processes with
Applications to Guidance, 1968): it holds for any gain K, here for that of the fit, which does not know P.
What torques tell has the second term alone; what they do not tell has the first, and is certain without P.
"""

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import link_sizes

from linkwise.arrays import Array
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.fit import Fit


def written_factor(fit: Fit, base: BaseParameters, own: Array, prior: Array | None) -> Array:
    """Return H (N, 10, Q), a factor of the covariance of all links' parameters.

    own: the file's own parameters (N, 10); prior: a factor (10 N, K) of their covariance P; None for zero
    """
    sizes = link_sizes(own).reshape(-1)
    equations = base_triangle(fit, base) @ base.combinations * sizes
    _, values, right = np.linalg.svd(equations, full_matrices=False)
    columns = [sizes[:, None] * right.T * (values / (1.0 + values**2))]
    if prior is not None:
        scaled = prior / sizes[:, None]
        told = right.T @ ((values**2 / (1.0 + values**2))[:, None] * (right @ scaled))
        columns.append(sizes[:, None] * (scaled - told))
    # Triangular, by QR: as many columns as needed, and half of them zeros.
    triangle: Array = np.asarray(np.linalg.qr(np.hstack(columns).T, mode="r"))
    return triangle.T.reshape(*own.shape, -1)


def base_triangle(fit: Fit, base: BaseParameters) -> Array:
    """Return the triangle R (base, base): (R^T R)^-1 is the covariance of beta, friction fitted too."""
    whole = fit.triangle[:-1, :-1]
    frictions = whole.shape[1] - base.count
    ordered = np.hstack([whole[:, base.count :], whole[:, : base.count]])
    triangle: Array = np.asarray(np.linalg.qr(ordered, mode="r"))
    return triangle[frictions:, frictions:]
