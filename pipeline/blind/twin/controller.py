"""Position control at the motor's encoder: PD at a fixed rate, with a prepared feed-forward."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plan:
    """What the controller is to follow.

    Attributes:
        period: Between samples, the controller's own [s].
        position: Joint targets [rad], shape (N, J).
        velocity: [rad/s], shape (N, J).
        feedforward: Torque at the joint [N*m], shape (N, J).
        log_from: Time from which the log is kept [s].
        base_position: Where a floating base starts [m], shape (3,); None for a fixed base.
        cycles: Duration of every walking cycle [s]; empty where nothing walks.
    """

    period: float
    position: Array
    velocity: Array
    feedforward: Array
    log_from: float
    base_position: Array | None = None
    cycles: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """[s]."""
        return self.period * (self.position.shape[0] - 1)


@dataclass(frozen=True)
class Controller:
    """Gains, the same for every joint.

    Attributes:
        proportional: [N*m/rad] at the joint.
        derivative: [N*m*s/rad] at the joint.
        counts: Encoder counts per turn of the motor [1].
        velocity_cutoff: Of the first-order filter on the differenced encoder [Hz].
    """

    proportional: float = 3500.0
    derivative: float = 125.0
    counts: int = 4096
    velocity_cutoff: float = 80.0


class ControlLoop:
    """A `Controller` following a `Plan`, holding its output between its samples."""

    def __init__(self, controller: Controller, plan: Plan, ratio: float, coupling: Array) -> None:
        self._gains = controller
        self._plan = plan
        # The controller knows which motor turns with which joint.
        self._target = plan.position @ coupling.T
        self._target_rate = plan.velocity @ coupling.T
        self._feedforward = plan.feedforward @ np.linalg.inv(coupling)
        self._quantum = 2 * np.pi / (controller.counts * ratio)  # [rad] at the joint
        self._blend = 1 - np.exp(-2 * np.pi * controller.velocity_cutoff * plan.period)
        self._last: Array | None = None
        self._rate = np.zeros(coupling.shape[0])

    def command(self, sample: int, motor: Array) -> Array:
        """Torque command at the joint [N*m], shape (J,).

        Args:
            sample: Of the plan.
            motor: Motor angles, at the joint [rad], shape (J,).
        """
        seen = np.rint(motor / self._quantum) * self._quantum
        if self._last is not None:
            self._rate = self._rate + self._blend * (
                (seen - self._last) / self._plan.period - self._rate
            )
        self._last = seen
        gains = self._gains
        result: Array = (
            gains.proportional * (self._target[sample] - seen)
            + gains.derivative * (self._target_rate[sample] - self._rate)
            + self._feedforward[sample]
        )
        return result
