"""The calibration as a least-squares problem in the prior's coordinates.

Residuals are the prior distance, the distance of every fitted row from its printed value in half
widths, and a steep hinge where a motor leaves its data sheet. The break-even is stiff near 1, so
the energy difference it asks for is fitted in its place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from actuators.build import Catalog
from actuators.limits import limit_rows
from actuators.units import to_si
from pipeline.calibration.machine import (
    ROBOT,
    ActuatorPart,
    RobotPart,
    actuator_part,
    catalog_with,
    robot_part,
    standing_targets,
)
from pipeline.calibration.prior import Prior
from pipeline.calibration.published import Published
from pipeline.calibration.quantities import computed, walking_extra
from pipeline.errors import PipelineError
from pipeline.robot_file import RobotSpec

Array = NDArray[np.float64]
#: Rows met exactly by solving the posture.
EXACT = ("standing_reaction_rm", "standing_torque_2", "standing_torque_3")
EXTRA = "walking_extra_J"
#: Fitted rows whose half width is mere rounding: any value within it is as good as another.
ROUNDED = ("ideal_current_2", "ideal_voltage_2", "rotor_motor_torque_2")
_INSIDE = 1.0  # half widths, within which a rounded row pulls at nothing
_STEEP = 200.0  # residual per relative excess over a motor limit
_STEP = 1e-4  # of a prior standard deviation, for derivatives


@dataclass(frozen=True)
class Target:
    """A fitted number: centre and half width in SI units."""

    name: str
    centre: float
    half_width: float


@dataclass(frozen=True)
class Evaluation:
    """One point of the search.

    Attributes:
        values: Published quantities, SI, by id; and the fitted energy difference.
        excess: Motor limits, relative: peak over limit less one; negative is inside.
        robot: The robot's part.
        actuators: The actuators' part.
    """

    values: Mapping[str, float]
    excess: Mapping[str, float]
    robot: RobotPart
    actuators: ActuatorPart


@dataclass
class Problem:
    """What is fitted, to what, starting from which files.

    Attributes:
        spec: Robot file, its transfer path included.
        catalog: Actuator catalogue.
        prior: Free numbers.
        published: All printed values.
        standing_legs: How many middle legs Fig. 21 counts as loaded.
        without: A target left out, or None.
        posture_offset: Added to the reaction [N] and the torques [N*m] that fix the posture.
    """

    spec: RobotSpec
    catalog: Catalog
    prior: Prior
    published: Mapping[str, Published]
    standing_legs: int = 1
    without: str | None = None
    posture_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    _robots: dict[bytes, RobotPart] = field(default_factory=dict, repr=False)

    @property
    def robot_columns(self) -> NDArray[np.intp]:
        """Coordinates that belong to the robot."""
        own = [i for i, key in enumerate(self.prior.keys) if key.startswith(ROBOT + ".")]
        return np.array(own, dtype=np.intp)

    @property
    def actuator_columns(self) -> NDArray[np.intp]:
        """Coordinates that belong to the actuators."""
        return np.setdiff1d(np.arange(len(self.prior.free)), self.robot_columns)

    @property
    def targets(self) -> tuple[Target, ...]:
        """What the least-squares part fits; the posture meets the others exactly."""
        rows = [
            Target(p.id, to_si(p.value, p.unit), to_si(p.half_width, p.unit))
            for p in self.published.values()
            if p.role == "target" and p.id not in EXACT and p.id != self.without
        ]
        if self.without != EXTRA:
            rows.append(extra_target(self.published, self.standing_legs))
        return tuple(rows)

    def robot(self, z: Array) -> RobotPart:
        """The robot's part at coordinates (D,), remembered."""
        key = z[self.robot_columns].tobytes()
        if key not in self._robots:
            if len(self._robots) > 64:
                self._robots.clear()
            goal = standing_targets(self.published) + np.array(self.posture_offset)
            self._robots[key] = robot_part(self.spec, self.prior.values(z), goal)
        return self._robots[key]

    def evaluate(self, z: Array) -> Evaluation:
        """Everything at coordinates (D,).

        Raises:
            PipelineError: The robot cannot take this shape.
        """
        robot = self.robot(z)
        ratio = self.catalog.parameter("requirement.ratio").value
        actuators = actuator_part(robot, catalog_with(self.catalog, self.prior.values(z), ratio))
        values = computed(robot, actuators, self.standing_legs)
        values[EXTRA] = walking_extra(actuators.energy)
        excess: dict[str, float] = {}
        for name, result in actuators.walking.items():
            for row in limit_rows(result, actuators.chains[name].motor):
                key = f"{name}.{row.quantity}"
                excess[key] = max(excess.get(key, -1.0), row.peak / row.limit - 1)
        return Evaluation(values, excess, robot, actuators)

    def residuals(self, z: Array, centre: Array, *, pull: float, goal: Array | None) -> Array:
        """Residual vector at z.

        Args:
            z: Coordinates (D,).
            centre: Coordinates whose neighbourhood is sought: 0 for the prior's centre.
            pull: Weight of the distance from the printed values, per half width.
            goal: Where to aim, in half widths from the printed values, (T,). None aims at the
                printed values, rounded ones anywhere within their rounding.
        """
        point = self.evaluate(z)
        error = np.array([(point.values[t.name] - t.centre) / t.half_width for t in self.targets])
        if goal is None:
            rounded = np.array([t.name in ROUNDED for t in self.targets])
            free = np.sign(error) * np.maximum(np.abs(error) - _INSIDE, 0.0)
            error = np.where(rounded, free, error)
        else:
            error = error - goal
        limits = _STEEP * np.maximum(np.array(list(point.excess.values())) + 0.005, 0.0)
        return np.concatenate([z - centre, pull * error, limits])

    def solve(
        self,
        start: Array,
        centre: Array,
        *,
        columns: NDArray[np.intp],
        pull: float,
        goal: Array | None = None,
        evaluations: int = 40,
    ) -> Array:
        """Least-squares solution in some of the coordinates, the others staying at `start`.

        Returns:
            Coordinates (D,).
        """

        def full(x: Array) -> Array:
            z = start.copy()
            z[columns] = x
            return z

        def residuals(x: Array) -> Array:
            try:
                return self.residuals(full(x), centre, pull=pull, goal=goal)
            except PipelineError:
                # Out of reach or tipping: a wall, felt as a large but finite residual.
                return np.full(self._size, 30.0)

        def jacobian(x: Array) -> Array:
            base = residuals(x)
            out = np.empty((base.size, x.size))
            for i in range(x.size):
                step = _STEP if x[i] + _STEP <= upper[i] else -_STEP
                moved = x.copy()
                moved[i] += step
                out[:, i] = (residuals(moved) - base) / step
            return out

        lower, upper = self.prior.lower[columns], self.prior.upper[columns]
        inside = np.clip(start[columns], lower + 1e-9, upper - 1e-9)
        found = optimize.least_squares(
            residuals,
            inside,
            jac=jacobian,
            bounds=(lower, upper),
            method="trf",
            x_scale=1.0,
            ftol=1e-8,
            xtol=1e-8,
            max_nfev=evaluations,
        )
        return full(found.x)

    @property
    def _size(self) -> int:
        return len(self.prior.free) + len(self.targets) + 4 * len(self.catalog.alternatives)

    def admissible(self, point: Evaluation) -> bool:
        """Whether every fitted row is reproduced and every motor inside its limits."""
        fits = all(
            abs(point.values[t.name] - t.centre) <= t.half_width * (1 + 1e-9) for t in self.targets
        )
        return fits and max(point.excess.values()) <= 0


def extra_target(published: Mapping[str, Published], standing_legs: int) -> Target:
    """The energy difference per middle leg and cycle that the printed break-even asks for [J]."""
    row = published["break_even_standing_fraction"]
    held = standing_legs * published["reversible_leg_energy_3s"].value  # [J] per cycle's time

    def extra(fraction: float) -> float:
        return fraction / (1 - fraction) * held / 2

    low, high = extra(row.value - row.half_width), extra(row.value + row.half_width)
    return Target(EXTRA, (low + high) / 2, (high - low) / 2)
