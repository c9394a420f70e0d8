"""Torque by the servos' own law, where a log tells targets and gains instead.

    tau = clip(kp (q_goal - q) + kd (v_goal - v) + tau_goal, -limit, limit)

the law of impedance-controlled drives and of learned controllers (Hwangbo et al. 2019, "Learning
agile and dynamic motor skills for legged robots", section "Actuator model"): what is commanded and
not what is measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Final, Self

import numpy as np
from pydantic import BeforeValidator, model_validator

from actuators.arrays import Array
from actuators.checked import Table, finite
from actuators.errors import closest, one_line

#: Beyond these a gain is a slip.
_LARGEST: Final = 1e6


def _gain(value: object) -> float:
    number = finite(value)
    if not 0.0 <= number <= _LARGEST:
        raise ValueError(f"must lie from 0 to {_LARGEST:g}")
    return number


def _gains(value: object) -> object:
    if not isinstance(value, Mapping):
        return _gain(value)
    out = {}
    for joint, number in value.items():
        try:
            out[joint] = _gain(number)
        except ValueError as error:
            raise ValueError(f"of {one_line(joint)} {error}") from None
    return out


#: One number for all joints, or one for each by the robot's name of it.
Gains = Annotated[float | dict[str, float], BeforeValidator(_gains)]
#: What a reader of results must know.
CANNOT = (
    "is computed by the servos' law from targets and gains, not measured: the delay and bandwidth "
    "of the servos, currents or torques they hold back, and gains other than stated are taken for "
    "the machine's"
)


class PdGains(Table):
    """Gains of the servos: stiffness [N*m/rad], damping [N*m*s/rad], largest torque [N*m]."""

    kp: Gains
    kd: Gains = 0.0
    limit: Gains | None = None

    @model_validator(mode="after")
    def _some(self) -> Self:
        if self.limit is not None and 0.0 in (
            self.limit.values() if isinstance(self.limit, dict) else (self.limit,)
        ):
            raise ValueError("limit must not be zero: nothing would move")
        return self

    def refuse_unknown(self, joints: Sequence[str]) -> None:
        """Refuse a table that names other joints, or not all of them, by a ValueError."""
        for key in ("kp", "kd", "limit"):
            table = getattr(self, key)
            if not isinstance(table, dict):
                continue
            for joint in table:
                if joint not in joints:
                    hint = closest(joint, list(joints))
                    raise ValueError(f"pd_gains.{key}: no joint '{one_line(joint)}'; {hint}")
            missing = [joint for joint in joints if joint not in table]
            if missing:
                raise ValueError(f"pd_gains.{key}: nothing for joint '{missing[0]}'")

    def torque(self, joints: Sequence[str], channels: Mapping[str, Array], time: Array) -> Array:
        """Torque by the law, (N, J) [N*m]; NaN where position or target are not known.

        Args:
            joints: Of the columns.
            channels: Position, goals and, where it is logged, velocity, each (N, J), SI units.
            time: Shape (N,) [s].
        """
        kp, kd = self._of(self.kp, joints), self._of(self.kd, joints)
        position = channels["position"]
        torque = kp * (channels["goal_position"] - position)
        if kd.any():
            velocity = channels.get("velocity")
            if velocity is None:
                velocity = np.gradient(position, time, axis=0)
            torque += kd * (np.nan_to_num(channels.get("goal_velocity", np.zeros(1))) - velocity)
        torque += np.nan_to_num(channels.get("goal_torque", np.zeros(1)))
        if self.limit is not None:
            limit = self._of(self.limit, joints)
            torque = np.clip(torque, -limit, limit)
        return np.asarray(torque)

    def formula(self, channels: Mapping[str, Array]) -> str:
        """The law as it was used, in words."""
        goal = "goal velocity" if "goal_velocity" in channels else "0"
        velocity = "velocity" if "velocity" in channels else "derivative of position"
        law = f"kp (goal - position) + kd ({goal} - {velocity})"
        law += " + goal torque" if "goal_torque" in channels else ""
        return law if self.limit is None else f"{law}, clipped at the limit"

    def by_joint(self, joints: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Stiffness and damping of every joint; a ValueError for gains of other joints."""
        self.refuse_unknown(joints)
        kp, kd = self._of(self.kp, joints), self._of(self.kd, joints)
        return {j: (float(p), float(d)) for j, p, d in zip(joints, kp, kd, strict=True)}

    @staticmethod
    def _of(gains: Gains, joints: Sequence[str]) -> Array:
        if isinstance(gains, dict):
            return np.array([gains[joint] for joint in joints])
        return np.full(len(joints), gains)
