"""Friction of a joint as curves over speed and position, where no law has a name for it.

Levels, their asymmetry and shares of the load stand at knots of the speed, dry friction more at
knots of the position. Between knots they are straight lines; beyond the last speed the last line
goes on as long as it takes energy out, beyond the last position its level stays.
"""

from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array, Mask, Scalars
from actuators.elements.element import Friction
from actuators.parameters import require
from actuators.shaft import ShaftSeries

_MOST_SHARE = 0.99  # of the load: at 1 no load could drive the shaft


@dataclass(frozen=True, eq=False)
class FrictionCurve(Friction):
    """Friction over speed, load and position, for one joint; of the terms `viscous` alone adds.

    Raises:
        LegwattError: Knots do not ascend, or the curves would give energy at a knot.
    """

    speeds: tuple[float, ...] = (0.0, 1.0)  #: Knots, ascending from 0, (K,) [rad/s].
    levels: tuple[float, ...] = (0.0, 0.0)  #: Mean of both directions at the knots, (K,) [N*m].
    #: By which it is larger forward and smaller backward, (K,) [N*m].
    asymmetries: tuple[float, ...] = (0.0, 0.0)
    #: Friction per transmitted torque at the knots, (K,), dimensionless.
    shares: tuple[float, ...] = (0.0, 0.0)
    #: Knots of the position, ascending, (P,) [rad]; none by default.
    places: tuple[float, ...] = ()
    spots: tuple[float, ...] = ()  #: Dry friction more at those, (P,) [N*m].

    def __post_init__(self) -> None:
        super().__post_init__()
        lengths = {len(x) for x in (self.speeds, self.levels, self.asymmetries, self.shares)}
        require(lengths == {len(self.speeds)} and len(self.speeds) > 1, self.name, "one per knot")
        ascending = self.speeds[0] == 0.0 and (np.diff(self.speeds) > 0.0).all()
        require(ascending, self.name, "speeds must ascend from 0")
        require(np.array(self.spots) >= 0.0, self.name, "spots must not be negative")
        sorted_ = len(self.places) == len(self.spots) and (np.diff(self.places) > 0.0).all()
        require(sorted_, self.name, "places must ascend, with a spot at each")
        passive = np.array(self.levels) + self.viscous * np.array(self.speeds)
        slack = 1e-9 * (1.0 + np.abs(passive).max())  # sums of terms that cancel leave rounding
        out = passive - np.abs(self.asymmetries) >= -slack
        require(out, self.name, "friction must not be negative in either direction")
        shares = np.array(self.shares)
        require((shares >= 0.0) & (shares <= _MOST_SHARE), self.name, "shares must be 0 to 0.99")

    def at(self, values: tuple[float, ...], speed: Array) -> Array:
        """Return a curve at speeds (...) [rad/s]; the last line goes on beyond the last knot."""
        x, y = np.array(self.speeds), np.array(values)
        beyond = np.maximum(speed - x[-1], 0.0) * (y[-1] - y[-2]) / (x[-1] - x[-2])
        return np.asarray(np.interp(speed, x, y) + beyond)

    def free(self, side: ShaftSeries, sense: Array) -> Array:
        """Return levels and asymmetry, (N, J) [N*m]; they take energy out at every speed."""
        velocity, speed = side.velocity, np.abs(side.velocity)
        level = np.maximum(self.at(self.levels, speed), -self.viscous * speed)
        most = level + self.viscous * speed
        skew = np.clip(self.at(self.asymmetries, speed), -most, most)
        # Towards standstill the asymmetry goes with the sense of motion, as dry friction does.
        if self.places:
            level = level + np.interp(side.position, self.places, self.spots)
        return np.asarray(level * sense + skew * np.abs(sense) + self.viscous * velocity)

    def share(self, velocity: Array, drives: Mask) -> Array:
        """Return friction per transmitted torque, (N, J)."""
        return np.clip(self.at(self.shares, np.abs(velocity)), 0.0, _MOST_SHARE)

    def static(self) -> tuple[Scalars, Scalars, Scalars, Scalars]:
        """Return the curves at standstill, at the place with the most friction."""
        skew, share = self.asymmetries[0], self.shares[0]
        level = self.levels[0] + max(self.spots, default=0.0)
        return max(level - skew, 0.0), max(level + skew, 0.0), share, share
