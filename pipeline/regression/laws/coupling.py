"""A motor that turns with another joint: friction and rotor inertia of a pair through one speed.

With the speed w = v_j + r v_i of motor j, its friction f and inertia act with f + I dw/dt on joint
j and with r times that on joint i (power is the same on both sides). Wrists with a differential or
with motors behind an axis couple with r = 1 or -1; which of the two motors it is then makes no
difference, and the outer joint is named.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.laws.friction import sense
from pipeline.regression.preprocess import Rows

Array = NDArray[np.float64]

#: Ratios looked for.
RATIOS: Final = (1.0, -1.0)
#: Axes that a motor's drive may pass on its way to its own joint.
PASSED: Final = 2
#: Terms of a coupled motor.
TERMS: Final = ("coulomb", "viscous", "inertia")


@dataclass(frozen=True, order=True)
class Coupling:
    """Motor of one joint that turns with another joint as well.

    Attributes:
        motor: Joint whose motor it is.
        other: Joint it turns with.
        ratio: Speed of the motor per speed of the other joint, both at the joint's side.
        rise: Speed of the motor over which its dry friction rises after a reversal [rad/s].
        travel: Travel of the motor over which it does, in place of a speed [rad].
    """

    motor: int
    other: int
    ratio: float
    rise: float = 0.0
    travel: float = 0.0

    def name(self, term: str) -> str:
        """Name of one of its columns."""
        return f"{self.motor}+{self.ratio:g}*{self.other}:{term}"

    @property
    def names(self) -> list[str]:
        """Names of its columns."""
        return [self.name(t) for t in TERMS]

    def speed(self, v: Array) -> Array:
        """Of the motor at the joint's side, (N,) [rad/s]."""
        return np.asarray(v[:, self.motor] + self.ratio * v[:, self.other])

    def slid(self, rows: Rows) -> Array | None:
        """Sense of its dry friction where that rises over a travel, fine, (M,)."""
        q = rows.fine[0]
        angle = q[:, self.motor] + self.ratio * q[:, self.other]
        return rows.slid(angle, self.travel) if self.travel else None

    def columns(
        self, v: Array, a: Array, sigma_v: Array, slid: Array | None = None
    ) -> dict[str, dict[int, Array]]:
        """Torque per size of every term on both joints, (N,) each; see `slid`."""
        speed = self.speed(v)
        change = a[:, self.motor] + self.ratio * a[:, self.other]
        noise = float(np.hypot(sigma_v[self.motor], self.ratio * sigma_v[self.other]))
        values = {
            "coulomb": sense(speed, noise, self.rise).sign if slid is None else slid,
            "viscous": speed,
            "inertia": change,
        }
        return {
            self.name(t): {self.motor: x, self.other: self.ratio * x} for t, x in values.items()
        }

    def halves(
        self, v: Array, a: Array, sigma_v: Array, slid: Array | None = None
    ) -> dict[str, dict[int, Array]]:
        """The same columns with the action on either joint apart: what no coupling would be."""
        whole = self.columns(v, a, sigma_v, slid)
        out = {}
        for name, parts in whole.items():
            out[f"{name}|motor"] = {self.motor: parts[self.motor]}
            out[f"{name}|other"] = {self.other: parts[self.other]}
        return out

    @property
    def half_names(self) -> list[str]:
        """Names of the halves, both of a term in succession."""
        return [f"{n}|{side}" for n in self.names for side in ("motor", "other")]


def every_pair(joints: int) -> list[Coupling]:
    """Couplings of joints in a chain whose motors may sit before the axes they pass."""
    return [
        Coupling(j, i, r)
        for j in range(joints)
        for i in range(max(0, j - PASSED), j)
        for r in RATIOS
    ]
