"""The calibration as a least-squares problem in the prior's coordinates.

Residuals are the prior distance, the distance of every fitted row from its printed value in half
widths, and a steep hinge where a motor leaves its data sheet. The break-even is stiff near 1, so
the energy difference it asks for is fitted in its place.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from actuators.loading.build import Catalog
from actuators.units import from_si, to_si
from pipeline.errors import PipelineError
from pipeline.paper.calibration.machine import (
    ROBOT,
    ActuatorPart,
    RobotPart,
    actuator_part,
    catalog_with,
    robot_part,
    standing_targets,
)
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.calibration.quantities import computed, walking_extra
from pipeline.paper.constants.motor_constants import Sliver, sliver
from pipeline.paper.constants.table_entries import entries
from pipeline.paper.published import Published
from pipeline.robot.robot_file import RobotSpec

Array = NDArray[np.float64]
#: Rows met exactly by solving the posture.
EXACT = ("standing_reaction_rm", "standing_torque_2", "standing_torque_3")
EXTRA = "walking_extra_J"
#: The energy difference stands for it among the fitted rows.
EVEN = "break_even_standing_fraction"
#: Met by the choice of the motor's constants, see `pipeline.paper.constants.motor_constants`.
CHOSEN = ("ideal_current_2", "ideal_voltage_2", "rotor_current_2")
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
            Named ``<alternative>.<quantity>``.
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
        without: Targets left out.
        constants: The motor's three constants, by reference; the sliver's middle where None.
        net: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
        posture_offset: Added to the reaction [N] and the torques [N*m] that fix the posture.
    """

    spec: RobotSpec
    catalog: Catalog
    prior: Prior
    published: Mapping[str, Published]
    standing_legs: int = 1
    without: tuple[str, ...] = ()
    constants: Mapping[str, float] | None = None
    net: bool = False
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
            if p.role == "target" and p.id not in (*EXACT, *CHOSEN, EVEN, *self.without)
        ]
        if EXTRA not in self.without:
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
        catalog = catalog_with(self.catalog, self.numbers(z), ratio)
        actuators = actuator_part(robot, catalog, net=self.net)
        values = computed(robot, actuators, self.standing_legs)
        values[EXTRA] = walking_extra(actuators.energy)
        excess = {
            f"{name}.{quantity}": value
            for name, outcome in actuators.outcomes.items()
            for quantity, value in outcome.excess.items()
        }
        return Evaluation(values, excess, robot, actuators)

    @cached_property
    def sliver(self) -> Sliver:
        """Motor constants that the tables allow."""
        return sliver(self.published)

    def numbers(self, z: Array) -> dict[str, float]:
        """Every number that is not in the paper, SI, by reference."""
        constants = self.sliver.middle if self.constants is None else self.constants
        return self.prior.values(z) | dict(constants)

    def residuals(self, z: Array, *, pull: float, free: float = 0.0) -> Array:
        """Residual vector at z: the prior's coordinates, the targets, the limits.

        Args:
            z: Coordinates (D,).
            pull: Weight of the distance from the printed values, per half width.
            free: Half widths around the printed values within which nothing pulls.
        """
        point = self.evaluate(z)
        error = np.array([(point.values[t.name] - t.centre) / t.half_width for t in self.targets])
        error = np.sign(error) * np.maximum(np.abs(error) - free, 0.0)
        limits = _STEEP * np.maximum(np.array(list(point.excess.values())) + 0.005, 0.0)
        return np.concatenate([z, pull * error, limits])

    def solve(
        self,
        start: Array,
        *,
        columns: NDArray[np.intp],
        pull: float,
        free: float = 0.0,
        evaluations: int = 40,
    ) -> Array:
        """Least-squares solution in some of the coordinates, the others staying at `start`.

        Args:
            start: Coordinates (D,).
            columns: Which coordinates may move.
            pull: Weight of the printed values.
            free: Half widths around them within which nothing pulls.
            evaluations: At most so many.

        Returns:
            Coordinates (D,).
        """

        def full(x: Array) -> Array:
            z = start.copy()
            z[columns] = x
            return z

        def residuals(x: Array) -> Array:
            try:
                return self.residuals(full(x), pull=pull, free=free)
            except PipelineError:
                # Out of reach or tipping: a wall, felt as a large but finite residual.
                return np.full(self._size, 30.0)

        lower, upper = self.prior.lower[columns], self.prior.upper[columns]
        inside = np.clip(start[columns], lower + 1e-9, upper - 1e-9)
        found = optimize.least_squares(
            residuals,
            inside,
            jac=partial(_differences, residuals, upper),
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

    def unmet(self, point: Evaluation) -> list[str]:
        """Ids of printed values that a point does not give at printed precision."""
        return [
            p.id
            for p in self.published.values()
            if not p.reproduced(from_si(point.values[p.id], p.unit))
        ]

    def admissible(self, point: Evaluation) -> bool:
        """Whether a point gives every printed value and every motor stays inside its limits.

        Values that contradict those by which the motor's constants were chosen are left out, and so
        are predictions, which would be none if they were asked for.
        """
        spared = {*self.sliver.frictions.unmet}
        spared |= {p.id for p in self.published.values() if p.role == "prediction"}
        extra = next(t for t in self.targets if t.name == EXTRA)
        fits = abs(point.values[EXTRA] - extra.centre) <= extra.half_width
        return fits and set(self.unmet(point)) <= spared and max(point.excess.values()) <= 0


def fixed_before(published: Mapping[str, Published]) -> set[str]:
    """Ids that are put in, or follow from that, before any walking figure is fitted.

    The posture gives Table III, the motor's constants give Tables IV and V.
    """
    out = {p.id for p in published.values() if p.role in ("input", "symmetry")} | set(EXACT)
    out |= {e.id for e in entries(published) if e.alternative != "reversible"}
    # Energies are made of what the others fix, or put in by a prior that need not give them.
    return {name for name in out if not name.endswith("_leg_energy_3s")}


def extra_target(published: Mapping[str, Published], standing_legs: int) -> Target:
    """The energy difference per middle leg and cycle that the printed break-even asks for [J]."""
    row = published["break_even_standing_fraction"]
    held = standing_legs * published["reversible_leg_energy_3s"].value  # [J] per cycle's time

    def extra(fraction: float) -> float:
        return fraction / (1 - fraction) * held / 2

    low, high = extra(row.value - row.half_width), extra(row.value + row.half_width)
    return Target(EXTRA, (low + high) / 2, (high - low) / 2)


def _differences(function: Callable[[Array], Array], upper: Array, x: Array) -> Array:
    """Jacobian by one-sided differences, backwards where a step would leave the bounds.

    Args:
        function: Of coordinates (D,), returns residuals (R,).
        upper: Bounds (D,).
        x: Where, (D,).

    Returns:
        (R, D).
    """
    base = function(x)
    out = np.empty((base.size, x.size))
    for i in range(x.size):
        step = _STEP if x[i] + _STEP <= upper[i] else -_STEP
        moved = x.copy()
        moved[i] += step
        out[:, i] = (function(moved) - base) / step
    return out
