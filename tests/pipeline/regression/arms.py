"""Small arms with friction for tests of the regression."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import parameters, with_parameters
from pipeline.regression.preprocess import Run

Array = NDArray[np.float64]
Law = Callable[[Array, Array], Array]


def arm(joints: int = 3) -> pin.Model:
    """Links of 0.3 m and 2 kg on axes that turn in turn about z and y."""
    model = pin.Model()
    parent, place = 0, pin.SE3.Identity()
    for k in range(joints):
        joint = pin.JointModelRZ() if k % 2 == 0 else pin.JointModelRY()
        parent = model.addJoint(parent, joint, place, f"joint_{k + 1}")
        inertia = pin.Inertia(2.0, np.array([0.15, 0.02, -0.01]), np.diag([0.004, 0.02, 0.022]))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        place = pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.05]))
    return model


def heavier(model: pin.Model, factors: Mapping[int, float]) -> pin.Model:
    """Bodies whose ten parameters are all multiplied, by joint index from 0."""
    tens = parameters(model).reshape(-1, 10).copy()
    for k, factor in factors.items():
        tens[k] *= factor
    return with_parameters(model, tens.ravel())


def log(
    model: pin.Model,
    laws: Mapping[int, Law],
    *,
    seconds: float = 40.0,
    noise: float = 0.02,
    coupled: tuple[int, int, Law] | None = None,
    seed: int = 0,
) -> tuple[Run, Run]:
    """A recording, its first 60 % and the rest.

    Args:
        model: The machine.
        laws: Joint to friction as a function of speed and load.
        seconds: Length.
        noise: Of the torque per torque, white and coloured alike.
        coupled: Motor, other joint and the friction of their summed speed.
        seed: Of motion and noise.
    """
    rng = np.random.default_rng(seed)
    rate = 200.0
    t = np.arange(0.0, seconds, 1.0 / rate)
    q = np.zeros((len(t), model.nv))
    v, a = np.zeros_like(q), np.zeros_like(q)
    for j in range(model.nv):
        for _ in range(4):
            w, size, phase = (
                2 * np.pi * rng.uniform(0.1, 0.8),
                rng.uniform(0.1, 0.4),
                rng.uniform(0, 6),
            )
            q[:, j] += size * np.sin(w * t + phase)
            v[:, j] += size * w * np.cos(w * t + phase)
            a[:, j] -= size * w**2 * np.sin(w * t + phase)
    data = model.createData()
    load = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    tau = load.copy()
    for j, law in laws.items():
        tau[:, j] += law(v[:, j], load[:, j])
    if coupled:
        motor, other, law = coupled
        torque = law(v[:, motor] + v[:, other], load[:, motor])
        tau[:, motor] += torque
        tau[:, other] += torque
    white, slow = rng.standard_normal(tau.shape), rng.standard_normal(tau.shape)
    for k in range(1, len(t)):
        slow[k] = 0.9 * slow[k - 1] + np.sqrt(1 - 0.81) * slow[k]
    tau += noise * tau.std(axis=0) * (white + slow)
    step = 2 * np.pi / 2**16
    q = np.round(q / step) * step
    cut = int(0.6 * len(t))
    return Run(t[:cut], q[:cut], tau[:cut]), Run(t[cut:], q[cut:], tau[cut:])
