"""Rigid bodies as ten parameters each: regressor, distance from the URDF, physical consistency.

Torque is linear in (m, m c, I about the joint's origin) of every body. A set of ten numbers is a
body when its pseudo-inertia

    P = [[Sigma, m c], [(m c)^T, m]],   Sigma = tr(I) / 2 - I

is positive definite (Wensing, Kim and Slotine, RA-L 2018; Rucker and Wensing, RA-L 2022). How far a
body is from its URDF is measured by tr((P0^-1 dP)^2), which does not depend on the frame, the unit
or the size of the body (Lee, Wensing and Park, T-RO 2020); the entropic divergence

    D(P, P0) = tr(P0^-1 P) - log det(P0^-1 P) - 4

has half of it as its second order, is convex in the parameters and infinite where the body is none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pinocchio as pin
import scipy.linalg
from numpy.typing import NDArray

from pipeline.regression.errors import RegressionError

Array = NDArray[np.float64]

#: Parameters of one body, in the order of `pin.Inertia.toDynamicParameters`.
PARAMETERS: Final = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
#: Unit of each.
UNITS: Final = ("kg", *("kg*m",) * 3, *("kg*m^2",) * 6)
#: A body is nowhere thinner than this share of its reach (point masses and rods of a URDF).
THINNEST: Final = 0.05
#: Newton steps at one strength of the barrier at most.
NEWTON_STEPS: Final = 60
#: Uncertainty at which the path of the barrier begins, and its growth from step to step.
FIRST: Final = 0.003
PATH: Final = 2.0


def _basis() -> Array:
    """Matrices E_k with P = sum of parameter k times E_k, shape (10, 4, 4)."""
    e = np.zeros((10, 4, 4))
    e[0, 3, 3] = 1.0
    for k in range(3):
        e[1 + k, k, 3] = e[1 + k, 3, k] = 1.0
    for k, (i, j) in {4: (0, 0), 5: (0, 1), 6: (1, 1), 7: (0, 2), 8: (1, 2), 9: (2, 2)}.items():
        if i == j:
            e[k, :3, :3] = 0.5 * np.eye(3)
            e[k, i, i] -= 1.0
        else:
            e[k, i, j] = e[k, j, i] = -1.0
    return e


_E: Final = _basis()


def pseudo_inertia(parameters: Array) -> Array:
    """Pseudo-inertia of bodies, (..., 10) to (..., 4, 4)."""
    out: Array = np.einsum("...k,kij->...ij", parameters, _E)
    return out


def regressor(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Torque per body parameter, shape (N, nv, 10 (njoints - 1))."""
    data = model.createData()
    out = np.empty((len(q), model.nv, 10 * (model.njoints - 1)))
    for k in range(len(q)):
        out[k] = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
    return out


def parameters(model: pin.Model) -> Array:
    """Parameters of the bodies of a model, shape (10 (njoints - 1),)."""
    return np.concatenate([np.asarray(i.toDynamicParameters()) for i in list(model.inertias)[1:]])


def with_parameters(model: pin.Model, values: Array) -> pin.Model:
    """A copy of a model whose bodies have these parameters, shape (10 (njoints - 1),)."""
    out = model.copy()
    for k, ten in enumerate(values.reshape(-1, 10)):
        out.inertias[k + 1] = pin.Inertia.FromDynamicParameters(ten)
    return out


@dataclass(frozen=True)
class Bodies:
    """The URDF's bodies as the centre of a distance.

    Attributes:
        nominal: Parameters of the URDF, (10 B,).
        centre: The same where they are bodies, else the nearest that is thick enough, (10 B,).
        free: Which bodies may change (those with a mass), (B,).
        metric: Of the distance at the centre, (10 B, 10 B); zero for bodies that may not change.
        trust: Weight of every body's distance, (B,).
    """

    nominal: Array
    centre: Array
    free: NDArray[np.bool_]
    metric: Array
    trust: Array

    @classmethod
    def of(cls, model: pin.Model) -> Bodies:
        """Take the bodies of a model.

        Raises:
            RegressionError: A joint is not of one degree of freedom.
        """
        for k in range(1, model.njoints):
            if model.joints[k].nv != 1 or model.joints[k].nq != 1:
                raise RegressionError(
                    f'joint "{model.names[k]}" has {model.joints[k].nv} degrees of freedom and '
                    f"{model.joints[k].nq} coordinates; expected joints of one each on a fixed base"
                )
        nominal = parameters(model)
        tens = nominal.reshape(-1, 10)
        free = tens[:, 0] > 0
        centre = tens.copy()
        metric = np.zeros((nominal.size, nominal.size))
        for k in map(int, np.flatnonzero(free)):
            centre[k] = _thick(tens[k], _reach(model, k + 1, tens[k]))
            inverse = np.linalg.inv(pseudo_inertia(centre[k]))
            g = np.einsum("ij,kjl->kil", inverse, _E)
            at = slice(10 * k, 10 * k + 10)
            metric[at, at] = np.einsum("kij,lji->kl", g, g)
        return cls(nominal, centre.ravel(), free, metric, np.ones(free.size))

    def trusting(self, body: int, trust: float) -> Bodies:
        """The same with one body's distance at another weight than the others'."""
        at = slice(10 * body, 10 * body + 10)
        metric, weights = self.metric.copy(), self.trust.copy()
        metric[at, at] *= trust / weights[body]
        weights[body] = trust
        return replace(self, metric=metric, trust=weights)

    def carrying(self, model: pin.Model, body: int, ten: Array) -> Bodies:
        """The same about a body that carries something, (10,); the URDF stays the URDF."""
        more = self.nominal.copy()
        more[10 * body : 10 * body + 10] += ten
        return replace(Bodies.of(with_parameters(model, more)), nominal=self.nominal)

    @property
    def columns(self) -> NDArray[np.bool_]:
        """Which parameters may change, (10 B,)."""
        return np.repeat(self.free, 10)

    def divergence(self, values: Array) -> tuple[float, Array, Array]:
        """Entropic divergence from the centre, its gradient and Hessian.

        Returns:
            Infinity (and zeros) where a body is none.
        """
        n = values.size
        gradient, hessian, total = np.zeros(n), np.zeros((n, n)), 0.0
        for k in np.flatnonzero(self.free):
            at = slice(10 * k, 10 * k + 10)
            p, p0 = pseudo_inertia(values[at]), pseudo_inertia(self.centre[at])
            scale = np.sqrt(np.diag(p0))
            sign, log = np.linalg.slogdet(p / np.outer(scale, scale))
            if sign <= 0 or np.linalg.eigvalsh(p / np.outer(scale, scale))[0] <= 0:
                return np.inf, gradient, hessian
            inverse, inverse0 = np.linalg.inv(p), np.linalg.inv(p0)
            own = float(np.trace(inverse0 @ p)) - log - 4.0
            own += float(np.linalg.slogdet(p0 / np.outer(scale, scale))[1])
            total += self.trust[k] * own
            g = np.einsum("ij,kjl->kil", inverse, _E)
            slope = np.einsum("ij,kji->k", inverse0, _E) - np.einsum("kii->k", g)
            gradient[at] = self.trust[k] * slope
            hessian[at, at] = self.trust[k] * np.einsum("kij,lji->kl", g, g)
        return total, gradient, hessian


def _reach(model: pin.Model, joint: int, ten: Array) -> float:
    """How far a body reaches from its joint: its centre of mass, its joints, its gyration [m]."""
    reach = [float(np.linalg.norm(ten[1:4])) / ten[0]]
    reach += [
        float(np.linalg.norm(model.jointPlacements[c].translation))
        for c in range(1, model.njoints)
        if model.parents[c] == joint
    ]
    reach.append(float(np.sqrt(max(ten[4] + ten[6] + ten[9], 0.0) / 2 / ten[0])))
    return max(reach)


def _thick(ten: Array, reach: float) -> Array:
    """The body with no principal direction thinner than `THINNEST` of its reach."""
    m = ten[0]
    c = ten[1:4] / m
    about = pseudo_inertia(ten)[:3, :3] / m - np.outer(c, c)
    value, vector = np.linalg.eigh(about)
    floor = (THINNEST * reach) ** 2
    if value[0] >= floor:
        return ten
    sigma = m * (vector @ np.diag(np.maximum(value, floor)) @ vector.T + np.outer(c, c))
    inertia = np.trace(sigma) * np.eye(3) - sigma
    out = ten.copy()
    out[4:] = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return out


def consistent(
    gram: Array, moment: Array, bodies: Bodies, sigma: float, start: Array | None = None
) -> Array:
    """Least squares under the divergence over sigma^2, a convex problem.

    The divergence is a barrier that is weak where little is known; Newton's method follows its path
    from a strong one, as interior-point methods do.

    Args:
        gram: Of all parameters, the bodies' first, (P, P).
        moment: (P,).
        bodies: Where they come from.
        sigma: Uncertainty of the URDF.
        start: A solution nearby, (P,); without it the path begins at the URDF.

    Returns:
        The parameters (P,), every body of which is one.
    """
    if start is not None:
        return _newton(gram, moment, bodies, sigma, start)
    x = np.zeros(len(moment))
    x[: bodies.nominal.size] = bodies.centre
    steps = max(1, int(np.ceil(np.log(sigma / FIRST) / np.log(PATH)))) if sigma > FIRST else 0
    for k in range(steps):
        x = _newton(gram, moment, bodies, FIRST * (sigma / FIRST) ** (k / steps), x)
    return _newton(gram, moment, bodies, sigma, x)


def _newton(gram: Array, moment: Array, bodies: Bodies, sigma: float, start: Array) -> Array:
    n = bodies.nominal.size
    x = start.copy()

    def value(x: Array) -> float:
        d = bodies.divergence(x[:n])[0]
        return float(0.5 * x @ gram @ x - moment @ x + d / sigma**2)

    f = value(x)
    for _ in range(NEWTON_STEPS):
        _, g, h = bodies.divergence(x[:n])
        gradient = gram @ x - moment
        hessian = gram.copy()
        gradient[:n] += g / sigma**2
        hessian[:n, :n] += h / sigma**2
        still = np.diag(hessian) <= 0
        hessian[still, still] = 1.0
        gradient[still] = 0.0
        scale = 1.0 / np.sqrt(np.diag(hessian))
        scaled = hessian * np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] += 1e-13
        try:
            factor = scipy.linalg.cho_factor(scaled, check_finite=False)
            step = -scale * scipy.linalg.cho_solve(factor, scale * gradient, check_finite=False)
        except np.linalg.LinAlgError:
            step = -scale * np.linalg.lstsq(scaled, scale * gradient, rcond=1e-13)[0]
        decrement = float(-gradient @ step)
        if decrement < 1e-6:
            break
        t = 1.0
        while t > 1e-10:
            trial = value(x + t * step)
            if trial <= f - 1e-4 * t * decrement:
                break
            t *= 0.5
        else:
            break
        x, f = x + t * step, trial
    return x
