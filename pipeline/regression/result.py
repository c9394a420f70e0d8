"""What an identification found, and the model that it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.presliding import presliding
from pipeline.regression.laws.coupling import Coupling
from pipeline.regression.laws.extras import Extra, Kind
from pipeline.regression.laws.friction import SMOOTH, Shape
from pipeline.regression.laws.payload import Payload
from pipeline.regression.preprocess import low_pass
from pipeline.regression.statistics.noise import Colour

Array = NDArray[np.float64]


class Level(StrEnum):
    """How far a finding is to be trusted."""

    CONFIRMED = "confirmed"  # name, law and size stand
    APPROXIMATE = "approximate"  # closes a large part; the law or the size is not exact
    SUSPECTED = "suspected"  # not in the model


@dataclass(frozen=True)
class Term:
    """One size of the model, or one that was left out.

    Attributes:
        place: Joint, or the two joints of a coupling.
        kind: In the field's terms.
        term: Column it is the size of.
        value: With its unit.
        low: Lower end of the 95 % interval.
        high: Upper end.
        unit: Of the three.
        share: Of draws of the log's blocks in which the same kind is chosen at the same place.
        closes: Of the joint's torque power that stays without it, how much it closes on blocks that
            did not fit it.
        level: Confirmed, approximate or suspected.
    """

    place: str
    kind: str
    term: str
    value: float
    low: float
    high: float
    unit: str
    share: float
    closes: float
    level: Level


@dataclass(frozen=True)
class Beside:
    """Something beside bodies, friction and couplings.

    Attributes:
        extra: What, and where.
        values: Of its columns, (K,).
        halves: Half of their 95 % intervals, (K,).
        share: Of draws of the log's blocks in which it predicts better than all others tried.
        rivals: Others that predict as well, within one standard error.
        closes: Of what stays unexplained without it at its joints, on blocks that did not fit it.
        level: Confirmed, approximate or suspected.
    """

    extra: Extra
    values: Array
    halves: Array
    share: float
    rivals: tuple[Extra, ...]
    closes: float
    level: Level


@dataclass(frozen=True)
class Friction:
    """Friction of one joint as a function.

    Attributes:
        joint: Name.
        law: Name of the law.
        terms: Sizes of its columns, offset and rotor inertia not among them.
        shape: What the columns depend on.
        share: Of draws in which the best law with a name has its terms, by the rarest of them;
            where it has none, in which no law with a name is near the best.
        level: Of the name.
        short: By how many standard errors the general member predicts better.
    """

    joint: str
    law: str
    terms: Mapping[str, float]
    shape: Shape
    share: float
    level: Level
    short: float

    def __call__(self, v: Array, load: Array | float = 0.0) -> Array:
        """Friction torque at speeds (N,) [rad/s] under loads [N*m], (N,) [N*m]."""
        v = np.asarray(v, dtype=np.float64)
        load = np.broadcast_to(np.asarray(load, dtype=np.float64), v.shape)
        columns, _ = self.shape.columns(v, np.zeros_like(v), load)
        return sum((x * columns[t] for t, x in self.terms.items()), np.zeros_like(v))


@dataclass(frozen=True)
class BaseParameter:
    """One combination of body parameters that the motion tells.

    Attributes:
        name: The combination.
        urdf: Value by the URDF.
        value: Fitted.
        low: Lower end of the 95 % interval.
        high: Upper end.
        unit: Of all four.
        far: (Fitted - URDF) per stated uncertainty of the URDF.
    """

    name: str
    urdf: float
    value: float
    low: float
    high: float
    unit: str
    far: float


@dataclass(frozen=True)
class Result:
    """A model and what is known of it.

    Attributes:
        model: With the bodies as fitted.
        refit: Whether bodies were fitted.
        urdf_uncertainty: Of the URDF, as validation chose it; 0 without refit.
        base: Base parameters; empty without refit.
        condition: Condition number of their scaled regressor.
        lost: Body parameters that no base parameter holds.
        terms: Every size, those of the general member left out.
        friction: Of every joint.
        couplings: Found.
        extras: Found beside them, those without a name among them.
        sizes: Of every column in the model: (place, term) to value.
        halves: Half of the 95 % interval of the same.
        bodies: Parameters of the bodies, (10 B,).
        bodies_spread: Covariance of the same by the curvature of the fit, (10 B, 10 B): what the
            log leaves open of them.
        bodies_scatter: The same by leaving out blocks: what the parts of the log disagree about.
        bodies_half: Half of their 95 % intervals; what the motion does not tell has the URDF's.
        refit_share: Of draws of the log's blocks in which fitted bodies predict better.
        noise: Of every joint.
        cutoff: Up to which the model was fitted [Hz].
        blocks: Number of blocks.
        sigma_v: Noise of the velocities [rad/s].
        rate: Of the rows that were fitted [Hz].
        gain: How many times what they should the torques read, (J,): noise is that of torques as
            they should be.
        loaded: What the one body carries that is far from its URDF; `bodies` have it in them.
        structured: Joints whose remainder stays alike for longer than a block, and is no noise.
    """

    model: pin.Model
    refit: bool
    urdf_uncertainty: float
    base: tuple[BaseParameter, ...]
    condition: float
    lost: tuple[str, ...]
    terms: tuple[Term, ...]
    friction: tuple[Friction, ...]
    couplings: tuple[Coupling, ...]
    extras: tuple[Beside, ...]
    sizes: Mapping[tuple[str, str], float]
    halves: Mapping[tuple[str, str], float]
    bodies: Array
    bodies_spread: Array
    bodies_scatter: Array
    bodies_half: Array
    refit_share: float
    noise: tuple[Colour, ...]
    cutoff: float
    blocks: int
    sigma_v: Array
    rate: float
    gain: Array
    structured: frozenset[int]
    loaded: Payload | None = None

    def predict(
        self,
        q: Array,
        v: Array,
        a: Array,
        rate: float | None = None,
        cutoff: float | None = None,
    ) -> Array:
        """Torque of the model, (N, J) [N*m], what sensors get wrong not in it.

        Args:
            q: (N, J) [rad].
            v: (N, J) [rad/s].
            a: (N, J) [rad/s^2].
            rate: Rows per second, of one run without gaps [Hz].
            cutoff: Of the low-pass that the motion, and the torque it is compared with, went
                through [Hz]: where friction jumps it goes through the same. Without rate and
                cut-off friction jumps.
        """

        def filtered(term: str, x: Array) -> Array:
            if rate is None or cutoff is None or term in SMOOTH:
                return x
            return low_pass(x, rate, cutoff)

        felt, out = self.passed(q, v, a), self._bodies_torque(q, v, a)
        for e in self.extras:
            own = e.extra.torque(q[:, e.extra.joint], e.values)
            spring = e.extra.kind is Kind.SPRING
            out[:, e.extra.joint] += own if spring else filtered(e.extra.kind, own)

        def slid(x: Array, travel: float) -> Array:
            return presliding(np.arange(len(x), dtype=float), x, np.sign(np.gradient(x)), travel)

        for j, friction in enumerate(self.friction):
            travel = friction.shape.travel
            sense = {travel: slid(q[:, j], travel)} if travel else {}
            columns, _ = friction.shape.columns(v[:, j], a[:, j], felt[:, j], sense)
            for name, column in columns.items():
                size = self.sizes.get((str(j), name))
                if size is not None:
                    out[:, j] += size * filtered(name, column)
        for c in self.couplings:
            angle = q[:, c.motor] + c.ratio * q[:, c.other]
            way = slid(angle, c.travel) if c.travel else None
            for name, actions in c.columns(v, a, self.sigma_v, way).items():
                size = self.sizes.get(("shared", name))
                if size is not None:
                    for i, action in actions.items():
                        out[:, i] += size * filtered(name.split(":")[-1], action)
        return out

    def passed(self, q: Array, v: Array, a: Array) -> Array:
        """Torque of bodies, springs and ripple, which goes through a joint's drive, (N, J) [N*m].

        Args:
            q: (N, J) [rad].
            v: (N, J) [rad/s].
            a: (N, J) [rad/s^2].
        """
        out = self._bodies_torque(q, v, a)
        for e in self.extras:
            out[:, e.extra.joint] += e.extra.torque(q[:, e.extra.joint], e.values)
            if e.extra.kind is Kind.SPRING:
                out[:, e.extra.joint] += self.sizes.get((str(e.extra.joint), "offset"), 0.0)
        return out

    def _bodies_torque(self, q: Array, v: Array, a: Array) -> Array:
        data = self.model.createData()
        rows = zip(q, v, a, strict=True)
        return np.array([pin.rnea(self.model, data, *row) for row in rows]).reshape(q.shape)

    def at(self, place: str) -> Sequence[Term]:
        """Terms of one joint or pair."""
        return [t for t in self.terms if t.place == place]
