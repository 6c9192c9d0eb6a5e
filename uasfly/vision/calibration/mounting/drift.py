"""Errors of the autopilot's motion that change slowly, as knots with a prior, and the normal equations with them.

The position error is a random walk (Kalaitzakis & Vitzilaios 2023, eq. 11), the attitude error a first-order
Gauss-Markov process; where the autopilot says that its estimate has jumped both begin anew. Between knots they change
evenly. The knots' part of the normal equations is block tridiagonal, so that it is taken out (Schur) in linear time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from uasfly.messages import Array
from uasfly.vision.calibration.mounting.model import Linearised
from uasfly.vision.calibration.mounting.observations import Indices

KNOT_S = 0.25
WANDER_TIME_S = 4.0  # correlation time of the attitude error
_FIRST_M = 1e-3  # the first position error: where bundles are in the world is counted from there
_JUMP_M = 100.0  # what a jump may be
_BAND = 11


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of what disturbs.

    Attributes:
        sighting_scale: factor on the sigmas that the detector states.
        position_m: white noise of the position, an axis. attitude_rad: of the attitude.
        walk_m_sqrt_s: random walk of the position. wander_rad: slow error of the attitude.
    """

    sighting_scale: float = 1.0
    position_m: float = 0.03
    attitude_rad: float = 0.003
    walk_m_sqrt_s: float = 0.1
    wander_rad: float = 0.005

    @property
    def logarithms(self) -> Array:
        """(5,) natural logarithms of the figures in their order."""
        return np.log(
            (self.sighting_scale, self.position_m, self.attitude_rad, self.walk_m_sqrt_s, self.wander_rad)
        ).astype(float)

    @staticmethod
    def of_logarithms(values: Array) -> Noise:
        """The inverse of `logarithms`."""
        return Noise(*(float(value) for value in np.exp(values)))


class Knots:
    """Knots of the motion's errors around times.

    Args:
        time_s: (n,) of the sightings, in order.
        stretch: (n,) number that changes where the motion has jumped.
    """

    def __init__(self, time_s: Array, stretch: Indices) -> None:
        self.stretch = stretch
        times: list[Array] = []
        self.index = np.zeros(len(time_s), dtype=np.intp)
        self.share = np.zeros(len(time_s))
        self.starts: list[int] = []
        for number in dict.fromkeys(stretch.tolist()):
            its = np.flatnonzero(stretch == number)
            cells = np.floor((time_s[its] - time_s[0]) / KNOT_S).astype(np.intp)
            grid = np.unique(np.concatenate((cells, cells + 1)))
            self.starts.append(sum(map(len, times)))
            self.index[its] = self.starts[-1] + np.searchsorted(grid, cells)
            self.share[its] = (time_s[its] - time_s[0]) / KNOT_S - cells
            times.append(time_s[0] + KNOT_S * grid)
        self.time_s = np.concatenate(times)
        self._gap_s = np.diff(self.time_s)
        self._joined = np.ones(len(self.time_s) - 1, dtype=bool)
        self._joined[[start - 1 for start in self.starts[1:]]] = False

    def between(self, values: Array) -> Array:
        """Errors (n, 6) at the sightings, of values (k, 6) at the knots."""
        share = self.share[:, None]
        return np.asarray((1.0 - share) * values[self.index] + share * values[self.index + 1], dtype=float)

    def prior(self, noise: Noise) -> tuple[Array, Array, float]:
        """Diagonal (k, 6) and next-to-diagonal (k - 1, 6) of the prior's information, and its log-determinant."""
        count, joined = len(self.time_s), self._joined
        gap_s = np.where(joined, self._gap_s, 1.0)
        keep = np.exp(-gap_s / WANDER_TIME_S)
        walk = np.where(joined, 1.0 / (noise.walk_m_sqrt_s**2 * gap_s), 0.0)
        wander = np.where(joined, 1.0 / (noise.wander_rad**2 * (1.0 - keep**2)), 0.0)
        first = np.full(len(self.starts), 1.0 / _JUMP_M**2)
        first[0] = 1.0 / _FIRST_M**2
        diagonal, beside = np.zeros((count, 6)), np.zeros((count - 1, 6))
        for part, by_start, by_gap, kept in (
            (slice(0, 3), first, walk, np.ones_like(keep)),
            (slice(3, 6), np.full(len(first), noise.wander_rad**-2), wander, keep),
        ):
            diagonal[self.starts, part] += by_start[:, None]
            diagonal[1:, part] += by_gap[:, None]
            diagonal[:-1, part] += (by_gap * kept**2)[:, None]
            beside[:, part] = -(by_gap * kept)[:, None]
        logs = np.log(walk[joined]).sum() + np.log(wander[joined]).sum() + np.log(first).sum()
        return diagonal, beside, 3.0 * float(logs - 2.0 * len(first) * np.log(noise.wander_rad))


@dataclass(frozen=True, slots=True)
class Solved:
    """A step of Gauss-Newton, and what the problem looks like from where it begins.

    Attributes:
        step: (size,) of the unknowns. knots: (k, 6) of the knots.
        information: (size, size) of the unknowns, with the motion's errors taken out.
        cost: twice the negative logarithm of the probability here. least: the same after the step, if all were linear.
        likelihood: log of the restricted likelihood of the noise (Harville 1977), but for constants.
        distance: (n,) squared length of each residual here, in sigmas.
    """

    step: Array
    knots: Array
    information: Array
    cost: float
    least: float
    likelihood: float
    distance: Array


def covariance(linear: Linearised, noise: Noise) -> Array:
    """Covariance (n, 6, 6) of the residuals, without the knots' errors."""
    turned, detector = noise.attitude_rad**2, noise.sighting_scale**2
    S: Array = detector * linear.seen + turned * linear.by_attitude @ linear.by_attitude.transpose(0, 2, 1)
    S[:, range(3), range(3)] += noise.position_m**2
    return S


def solve(
    linear: Linearised,
    weights: Array,
    noise: Noise,
    knots: Knots,
    values: Array,
    prior: tuple[Array, Array],
    damping: float = 0.0,
) -> Solved:
    """Solve the normal equations.

    Args:
        linear: residuals and derivatives at the present unknowns and knots.
        weights: (n,) 0..1 of the sightings.
        noise: how large what disturbs is.
        knots: of the motion's errors.
        values: (k, 6) the present ones.
        prior: of the unknowns: (size,) information and (size,) how far they are from where it is centred.
        damping: share of the information's diagonal that is added for the step (Levenberg-Marquardt).
    """
    root = np.linalg.cholesky(covariance(linear, noise))
    columns = np.concatenate((linear.by_unknowns, linear.by_motion, linear.residuals[..., None]), axis=2)
    white = np.linalg.solve(root, columns)
    distance = (white[..., -1] ** 2).sum(axis=1)
    white *= np.sqrt(weights)[:, None, None]
    size = linear.by_unknowns.shape[2]
    J, H, r = white[..., :size], white[..., size : size + 6], white[..., -1]
    own, across = H.transpose(0, 2, 1) @ H, J.transpose(0, 2, 1) @ H
    gradient_own = np.einsum("nij,ni->nj", H, r)

    diagonal, beside, prior_log = knots.prior(noise)
    count, left, right = len(values), 1.0 - knots.share, knots.share
    D, L = np.zeros((count, 6, 6)), np.zeros((count - 1, 6, 6))
    B, g = np.zeros((count, size, 6)), np.zeros((count, 6))
    for shift, share in ((0, left), (1, right)):
        np.add.at(D, knots.index + shift, (share**2)[:, None, None] * own)
        np.add.at(B, knots.index + shift, share[:, None, None] * across)
        np.add.at(g, knots.index + shift, share[:, None] * gradient_own)
    np.add.at(L, knots.index, (left * right)[:, None, None] * own)
    D[:, range(6), range(6)] += diagonal
    L[:, range(6), range(6)] += beside
    drawn = diagonal * values
    drawn[1:] += beside * values[:-1]
    drawn[:-1] += beside * values[1:]
    g += drawn

    information, off = prior
    flat = J.reshape(-1, size)
    N = flat.T @ flat + np.diag(information)
    gradient = flat.T @ r.reshape(-1) + information * off
    cost = float((r**2).sum() + (values * drawn).sum() + (information * off**2).sum())

    factor = cholesky_banded(_banded(D, L), lower=True)
    B_flat, g_flat = B.transpose(0, 2, 1).reshape(-1, size), g.reshape(-1)
    taken = cho_solve_banded((factor, True), np.column_stack((B_flat, g_flat)))
    schur = N - B_flat.T @ taken[:, :size]
    schur = 0.5 * (schur + schur.T)
    reduced = gradient - B_flat.T @ taken[:, size]
    step = -np.linalg.solve(schur + damping * np.diag(np.diag(schur)), reduced)
    knot_step = -taken[:, size] - taken[:, :size] @ step
    least = cost - float(g_flat @ taken[:, size]) - float(reduced @ np.linalg.solve(schur, reduced))
    logs = 2.0 * float(np.log(root[weights > 0.0][:, range(6), range(6)]).sum())
    logs += 2.0 * float(np.log(factor[0]).sum()) - prior_log + float(np.linalg.slogdet(schur)[1])
    return Solved(step, knot_step.reshape(-1, 6), schur, cost, least, -0.5 * (least + logs), distance)


def _banded(diagonal: Array, below: Array) -> Array:
    """Lower band, as SciPy stores it, of a symmetric matrix with blocks (k, 6, 6) and, below them, (k - 1, 6, 6)'."""
    count = len(diagonal)
    band = np.zeros((_BAND + 1, 6 * count))
    for row in range(6):
        for column in range(6):
            if row >= column:
                band[row - column, column::6] = diagonal[:, row, column]
            band[6 + row - column, column : 6 * (count - 1) : 6] = below[:, row, column]
    return band
