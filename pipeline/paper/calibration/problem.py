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

from actuators.arrays import Array
from actuators.loading.build import Catalog
from actuators.units import from_si
from pipeline.errors import PipelineError
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.hexapod import (
    ROBOT,
    Outcome,
    RobotPart,
    outcomes,
    robot_part,
    solve_posture,
    with_splits,
)
from pipeline.paper.motor_constants import FeasibleSet, feasible_set
from pipeline.paper.published import EVEN, EXTRA, Published
from pipeline.paper.quantities import computed
from pipeline.robot.robot_file import RobotSpec

#: Rows met exactly by solving the posture.
EXACT = ("standing_reaction_rm", "standing_torque_2", "standing_torque_3")
#: Met by the choice of the motor's constants, see `pipeline.paper.motor_constants`.
CHOSEN = ("ideal_current_2", "ideal_voltage_2", "rotor_current_2")
_STEEP = 200.0  # residual per relative excess over a motor limit
_STEP = 1e-4  # of a prior standard deviation, for derivatives
_REMEMBERED = 64  # robots: derivatives of actuators and blocks of draws share them


@dataclass(frozen=True)
class Target:
    """A fitted number: centre and half width in SI units."""

    name: str
    centre: float
    half_width: float


@dataclass(frozen=True)
class Evaluation:
    """One set of numbers, evaluated."""

    values: Mapping[str, float]  #: Published quantities and the fitted energy difference, SI.
    #: Peak over the motor's limit less one, by ``<alternative>.<quantity>``; negative is inside.
    excess: Mapping[str, float]
    robot: RobotPart
    outcomes: Mapping[str, Outcome]  #: By alternative.


@dataclass
class Problem:
    """What is fitted, to what, starting from which files."""

    spec: RobotSpec  #: Robot file, its transfer path included.
    catalog: Catalog
    prior: Prior  #: Free numbers.
    published: Mapping[str, Published]  #: All printed values.
    standing_legs: int = 1  #: How many middle legs Fig. 21 counts as loaded.
    without: tuple[str, ...] = ()  #: Targets left out.
    #: The motor's three constants, by reference; the mean of all allowed where None.
    constants: Mapping[str, float] | None = None
    net: bool = False  #: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
    _robots: dict[bytes, RobotPart] = field(default_factory=dict, repr=False)

    @property
    def robot_columns(self) -> NDArray[np.intp]:
        """Coordinates that belong to the robot."""
        return np.flatnonzero([key.startswith(f"{ROBOT}.") for key in self.prior.keys])

    @property
    def actuator_columns(self) -> NDArray[np.intp]:
        """Coordinates that belong to the actuators."""
        return np.setdiff1d(np.arange(len(self.prior.free)), self.robot_columns)

    @property
    def ratio(self) -> float:
        """Total ratio of every alternative."""
        return self.catalog.parameter("requirement.ratio").value

    @property
    def targets(self) -> tuple[Target, ...]:
        """What the least-squares part fits; the posture meets the others exactly."""
        rows = [
            Target(p.id, p.si, p.half_width_si)
            for p in self.published.values()
            if p.role == "target" and p.id not in (*EXACT, *CHOSEN, EVEN, *self.without)
        ]
        if EXTRA not in self.without:
            rows.append(extra_target(self.published, self.standing_legs))
        return tuple(rows)

    @cached_property
    def feasible(self) -> FeasibleSet:
        """Motor constants that the tables allow."""
        return feasible_set(self.published)

    def numbers(self, z: Array) -> dict[str, float]:
        """Every number that is not in the paper, SI, by reference."""
        constants = self.feasible.middle if self.constants is None else self.constants
        return self.prior.values(z) | dict(constants)

    def robot(self, z: Array) -> RobotPart:
        """The robot's part at coordinates (D,), remembered.

        Raises:
            PipelineError: Out of reach, tipping, or no posture meets the targets.
        """
        key = z[self.robot_columns].tobytes()
        if key not in self._robots:
            if len(self._robots) > _REMEMBERED:
                self._robots.clear()
            own = {k.split(".")[1]: v for k, v in self._of(z, robot=True).items()}
            goal = np.array([self.published[name].value for name in EXACT])
            spec = solve_posture(self.spec.with_parameters(own), goal)
            self._robots[key] = robot_part(spec)
        return self._robots[key]

    def _of(self, z: Array, *, robot: bool) -> dict[str, float]:
        """Numbers of the robot, or of components, SI, by reference."""
        values = self.numbers(z)
        return {k: v for k, v in values.items() if k.startswith(f"{ROBOT}.") == robot}

    def evaluate(self, z: Array) -> Evaluation:
        """Everything at coordinates (D,).

        Raises:
            PipelineError: The robot cannot take this shape.
        """
        robot = self.robot(z)
        own = with_splits(self._of(z, robot=False), self.ratio)
        found = outcomes(robot.demand, self.catalog, own)
        values = computed(robot, found, self.standing_legs, net=self.net)
        excess = {
            f"{name}.{quantity}": float(value[0])
            for name, outcome in found.items()
            for quantity, value in outcome.excess.items()
        }
        return Evaluation(values, excess, robot, found)

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
            pull: Weight of the distance from the printed values, per half width.
            free: Half widths around them within which nothing pulls.
            evaluations: At most so many.

        Returns:
            Coordinates (D,).
        """
        targets, z = self.targets, start.copy()

        def residuals(x: Array) -> Array:
            z[columns] = x
            try:
                point = self.evaluate(z)
            except PipelineError:
                # Out of reach or tipping: a wall, a large but finite residual.
                return np.full(z.size + len(targets) + 4 * len(self.catalog.alternatives), 30.0)
            error = np.array([(point.values[t.name] - t.centre) / t.half_width for t in targets])
            error = np.sign(error) * np.maximum(np.abs(error) - free, 0.0)
            limits = np.maximum(np.array(list(point.excess.values())) + 0.005, 0.0)
            return np.concatenate([z, pull * error, _STEEP * limits])

        lower, upper = self.prior.ends[:, columns]
        found = optimize.least_squares(
            residuals,
            np.clip(start[columns], lower + 1e-9, upper - 1e-9),
            jac=partial(_differences, residuals, upper),
            bounds=(lower, upper),
            x_scale=1.0,
            ftol=1e-8,
            xtol=1e-8,
            max_nfev=evaluations,
        )
        z[columns] = found.x
        return z

    def unmet(self, point: Evaluation) -> list[str]:
        """Ids of printed values that a point does not give at printed precision."""
        values = {p: from_si(point.values[p.id], p.unit) for p in self.published.values()}
        return [p.id for p, value in values.items() if not p.reproduced(value)]

    def admissible(self, point: Evaluation) -> bool:
        """Whether a point gives every printed value and every motor stays inside its limits.

        Values that contradict those by which the motor's constants were chosen are left out, and so
        are predictions, which would be none if they were asked for.
        """
        spared = {*self.feasible.frictions.unmet}
        spared |= {p.id for p in self.published.values() if p.role == "prediction"}
        extra = next(t for t in self.targets if t.name == EXTRA)
        fits = abs(point.values[EXTRA] - extra.centre) <= extra.half_width
        return fits and set(self.unmet(point)) <= spared and max(point.excess.values()) <= 0


def fixed_before(published: Mapping[str, Published]) -> set[str]:
    """Ids that are put in, or follow from that, before any walking figure is fitted.

    The posture gives Table III, the motor's constants give Tables IV and V.
    """
    put_in = {p.id for p in published.values() if p.role in ("input", "symmetry")} | set(EXACT)
    tables = {name for name in published if name.startswith(("ideal_", "rotor_"))}
    # Energies are made of what the others fix, or put in by a prior that need not give them.
    return {name for name in put_in | tables if not name.endswith("_leg_energy_3s")}


def extra_target(published: Mapping[str, Published], standing_legs: int) -> Target:
    """The energy difference per middle leg and cycle that the printed break-even asks for [J]."""
    row = published[EVEN]
    held = standing_legs * published["reversible_leg_energy_3s"].value  # [J] per cycle's time

    def extra(fraction: float) -> float:
        return fraction / (1 - fraction) * held / 2

    low, high = extra(row.value - row.half_width), extra(row.value + row.half_width)
    return Target(EXTRA, (low + high) / 2, (high - low) / 2)


def _differences(function: Callable[[Array], Array], upper: Array, x: Array) -> Array:
    """Jacobian (R, D) by one-sided differences, backwards where a step would leave the bounds."""
    base = function(x)
    steps = np.where(x + _STEP <= upper, _STEP, -_STEP)
    return np.stack(
        [(function(x + row) - base) / row[i] for i, row in enumerate(np.diag(steps))], 1
    )
