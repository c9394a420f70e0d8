"""A payload told from bodies that are all a little off: one link is off by much more.

The fit knows the bodies' parameters with a covariance; with the URDF's prior taken out of it that
is a Gaussian likelihood N(b, L) of what they are off by, d. Under a prior of covariance C its
evidence is

    ln E = b^T (L + C^-1)^-1 b / 2 - ln det(1 + C L) / 2

(MacKay, "Bayesian interpolation", Neural Computation 4, 1992). That of one uncertainty for all
links is held against that of a smaller one for all but a link, which may carry anything. What such
a link has more is then fitted by a point mass m at c, with first moment m c and inertia
m (c^2 - c c^T).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from pipeline.effects.bodies.rigid_body_parameters import physical
from pipeline.identification import results as limits
from pipeline.identification.results import Member
from pipeline.identification.whole.told import Told, estimate
from pipeline.machine.machine import MachineModel
from pipeline.regression import Result
from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.options import Options

Array = NDArray[np.float64]
#: Uncertainty of a link that may carry anything, against its own mass and size.
LOADED: Final = 2.0
#: By how much likelier a payload must be than bodies that are all off.
ODDS: Final = 20.0
#: Chance below which what a link has more is no point mass.
NO_POINT: Final = 1e-3
#: Steps of Gauss and Newton.
_STEPS: Final = 30


@dataclass(frozen=True)
class Payload:
    """What one link carries.

    Attributes:
        joint: Number of its joint, from 0.
        values: Mass [kg] and place in the joint's frame [m], (4,).
        error: Standard errors of the same, (4,).
    """

    joint: int
    values: Array
    error: Array

    @property
    def ten(self) -> Array:
        """Its inertial parameters about the joint, (10,)."""
        return point(self.values)


def find_payload(result: Result, rigid: pin.Model) -> Payload | None:
    """The link that carries something, where one does.

    Args:
        result: Of the regression.
        rigid: Bodies before it.
    """
    if not result.refit or rigid.njoints < 3:
        return None
    seen = _Seen.of(result, rigid)
    grid = Options().uncertainties
    alike = max(seen.evidence({}, sigma) for sigma in grid)
    loaded = [
        (seen.evidence({k: LOADED}, sigma), k, sigma)
        for k in seen.links
        for sigma in grid
        if sigma < LOADED
    ]
    best, k, sigma = max(loaded)
    if best - alike < float(np.log(ODDS * len(seen.links))):
        return None
    found = seen.carried(k, sigma)
    if found is None or found.values[0] <= norm.ppf(0.975) * found.error[0]:
        return None
    own = result.bodies[10 * k : 10 * k + 10] - found.ten
    return found if physical(own) else None


def without(bodies: Array, load: Payload) -> Array:
    """Parameters of bodies (10 B,) less a payload."""
    out = bodies.copy()
    out[10 * load.joint : 10 * load.joint + 10] -= load.ten
    return out


def payloads(found: Payload | None, model: MachineModel, rigid: pin.Model) -> list[Told]:
    """As a finding."""
    if found is None:
        return []
    links = {joint: link for link, joint in model.links.items()}
    place = (links[str(rigid.names[found.joint + 1])],)
    half = float(norm.ppf(0.975)) * found.error
    names = (("mass", "kg"), ("x", "m"), ("y", "m"), ("z", "m"))
    parameters = tuple(
        estimate(name, float(v), float(h), unit, low=-1e4)
        for (name, unit), v, h in zip(names, found.values, half, strict=True)
    )
    member = Member(place, parameters, limits.CONFIRMED, float("nan"))
    return [Told("link_mass", "", "", (member,))]


def point(values: Array) -> Array:
    """Inertial parameters (10,) of a mass at a place, (4,)."""
    m, c = values[0], values[1:]
    inertia = m * (float(c @ c) * np.eye(3) - np.outer(c, c))
    return np.concatenate([[m], m * c, inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])


@dataclass(frozen=True)
class _Seen:
    """What a log says of bodies, in coordinates in which the URDF's prior is the unit matrix.

    Attributes:
        links: Numbers of the bodies that may change.
        basis: From these coordinates to parameters, by link, (10, 10).
        precision: L, (P, P).
        moment: b, (P,).
    """

    links: tuple[int, ...]
    basis: dict[int, Array]
    precision: Array
    moment: Array

    @classmethod
    def of(cls, result: Result, rigid: pin.Model) -> _Seen:
        """Take the prior out of a fit."""
        bodies = Bodies.of(rigid)
        links = tuple(int(k) for k in np.flatnonzero(bodies.free))
        basis = {}
        for k in links:
            at = slice(10 * k, 10 * k + 10)
            basis[k] = np.linalg.inv(np.linalg.cholesky(bodies.metric[at, at]).T)
        index = np.concatenate([np.arange(10 * k, 10 * k + 10) for k in links])
        turn = np.zeros((index.size, index.size))
        for n, k in enumerate(links):
            turn[10 * n : 10 * n + 10, 10 * n : 10 * n + 10] = np.linalg.inv(basis[k])
        spread = turn @ result.bodies_spread[np.ix_(index, index)] @ turn.T
        off = turn @ (result.bodies - bodies.centre)[index]
        sigma = result.urdf_uncertainty
        value, vector = np.linalg.eigh(spread)
        # What the log says is what the posterior knows beyond the prior.
        told = np.maximum(1.0 / np.clip(value, 1e-18, sigma**2) - sigma**-2, 0.0)
        posterior = (vector / np.clip(value, 1e-18, sigma**2)) @ vector.T
        return cls(links, basis, (vector * told) @ vector.T, posterior @ off)

    def _sigmas(self, own: dict[int, float], sigma: float) -> Array:
        return np.repeat([own.get(k, sigma) for k in self.links], 10)

    def evidence(self, own: dict[int, float], sigma: float) -> float:
        """Ln of the evidence of an uncertainty for all links but some."""
        s = self._sigmas(own, sigma)
        scaled = self.precision * np.outer(s, s) + np.eye(s.size)
        b = s * self.moment
        return float(0.5 * b @ np.linalg.solve(scaled, b) - 0.5 * np.linalg.slogdet(scaled)[1])

    def carried(self, link: int, sigma: float) -> Payload | None:
        """The point mass that a link has more than its own uncertainty explains."""
        s = self._sigmas({link: 1e3}, sigma)
        spread = np.linalg.inv(self.precision + np.diag(s**-2.0))
        n = self.links.index(link)
        at = slice(10 * n, 10 * n + 10)
        basis = self.basis[link]
        off = basis @ (spread @ self.moment)[at]
        cover = basis @ (spread[at, at] + sigma**2 * np.eye(10)) @ basis.T
        weight: Array = np.asarray(np.linalg.pinv(cover, hermitian=True, rcond=1e-14))
        return _point_in(off, weight, link)


def _point_in(off: Array, weight: Array, link: int) -> Payload | None:
    """Gauss and Newton for a point mass, from several places."""
    best: tuple[float, Array, Array] | None = None
    for start in _starts(off):
        x = start
        for _ in range(_STEPS):
            rest, slope = off - point(x), _slope(x)
            step = np.linalg.lstsq(slope.T @ weight @ slope, slope.T @ weight @ rest, rcond=1e-12)[
                0
            ]
            x = x + step
            x[0] = max(x[0], 1e-6)
            if np.abs(step).max() < 1e-9:
                break
        rest, slope = off - point(x), _slope(x)
        misfit = float(rest @ weight @ rest)
        if np.isfinite(misfit) and (best is None or misfit < best[0]):
            spread = np.linalg.pinv(slope.T @ weight @ slope, hermitian=True)
            best = misfit, x, np.asarray(spread, dtype=np.float64)
    if best is None or best[0] > float(chi2.isf(NO_POINT, 6)):
        return None
    return Payload(link, best[1], np.sqrt(np.maximum(np.diag(best[2]), 0.0)))


def _starts(off: Array) -> Iterator[Array]:
    """Masses to begin with, at the place that the first moments say."""
    for mass in {abs(float(off[0])), *(abs(float(off[0])) * f for f in (0.3, 3.0)), 0.1}:
        if mass > 0.0:
            yield np.concatenate([[mass], off[1:4] / mass])


def _slope(x: Array) -> Array:
    """Derivative of a point's parameters, (10, 4), by central differences."""
    out = np.empty((10, 4))
    for k in range(4):
        h = 1e-6 * max(abs(float(x[k])), 1e-2)
        e = np.zeros(4)
        e[k] = h
        out[:, k] = (point(x + e) - point(x - e)) / (2 * h)
    return out
