"""One blind trial: a machine with tolerances and something hidden, its logs and the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuators.errors import closest
from pipeline.blind.twin.controller import Plan
from pipeline.blind.twin.effects import EFFECTS, Hidden, draw, effect_named
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.machine import ALTERNATIVE, load_machine
from pipeline.blind.twin.reference import reference
from pipeline.blind.twin.sensors import NO_NOISE, NOISE_LEVELS, measure
from pipeline.blind.twin.setup import Setup, nominal_setup, stream, with_tolerances
from pipeline.blind.twin.simulator import Record
from pipeline.blind.twin.trajectories import leg_plan
from pipeline.blind.twin.walking import walking_plan
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import RobotSpec, load_robot_file

Array = NDArray[np.float64]
URDF_FOLDER = Path(__file__).parents[3] / "urdf"
ROBOT_FILES = {"leg": URDF_FOLDER / "leg.toml", "walk": URDF_FOLDER / "hexapod.toml"}
MOTIONS = tuple(ROBOT_FILES)


@dataclass(frozen=True)
class Trial:
    """What one trial leaves.

    Attributes:
        robot: The nominal robot's file.
        logs: Name to columns of the measured log, each (N,); all of one machine.
        exact: The same logs by sensors without noise and rounding; never written.
        truth: What was hidden and everything else that was drawn; for the sealed file.
    """

    robot: RobotSpec
    logs: dict[str, dict[str, Array]]
    exact: dict[str, dict[str, Array]]
    truth: dict[str, Any]


def make_trial(
    seed: int,
    effects: Sequence[str | Hidden] | str | None = None,
    motion: str = "leg",
    noise: str = "low",
    *,
    logs: int = 1,
    efforts: tuple[str, ...] = ("current", "voltage"),
    motor_encoder: bool = False,
    foot_force: str = "full",
    rate: float = 500.0,
) -> Trial:
    """Draw a machine, run it, measure it.

    Tolerances, motion, noise and every effect draw from random numbers of their own, so that the
    same seed with another effect is the same machine on the same motion.

    Args:
        seed: Of everything drawn, not negative.
        effects: Names of effects whose place and size are drawn, or effects with both; None or
            empty for nothing hidden.
        motion: ``"leg"`` on its stand or ``"walk"`` of the hexapod.
        noise: ``"low"`` or ``"high"``.
        logs: How many logs; each further one is of the same machine on another motion.
        efforts: Channels of the log.
        motor_encoder: Whether the motors' angles are logged, too.
        foot_force: ``"full"``, ``"normal"`` or ``"none"``.
        rate: Of the logs [Hz]; divides 2000.

    Raises:
        TwinError: An unknown effect, motion or noise level, or a simulation that ran away.
    """
    if motion not in MOTIONS:
        raise TwinError(f"motion '{motion}' is not known; {closest(motion, MOTIONS)}")
    if noise not in NOISE_LEVELS:
        raise TwinError(f"noise level '{noise}' is not known; {closest(noise, list(NOISE_LEVELS))}")
    if seed < 0:
        raise TwinError(f"seed {seed} is negative; give a whole number from 0")
    wanted = [effects] if isinstance(effects, str) else list(effects or ())
    robot = load_robot(load_robot_file(ROBOT_FILES[motion]))
    setup = nominal_setup(
        robot, load_machine(), plan_of(robot, seed, 0), NOISE_LEVELS[noise], rate=rate
    )
    sensors = replace(
        setup.sensors, efforts=efforts, motor_encoder=motor_encoder, foot_force=foot_force
    )
    setup = replace(setup, sensors=sensors)
    ref = reference(setup)
    hidden = []
    for item in wanted:
        name = item if isinstance(item, str) else item.effect
        effect = effect_named(name, motion)
        hidden.append(
            draw(effect, stream(seed, f"effect {name}"), ref) if isinstance(item, str) else item
        )
    machine, tolerances = with_tolerances(setup, seed)
    columns: dict[str, dict[str, Array]] = {}
    exact: dict[str, dict[str, Array]] = {}
    facts: dict[str, Any] = {}
    for i in range(logs):
        name = "log" if i == 0 else f"log_{i + 1}"
        run = replace(machine, plan=plan_of(robot, seed, i))
        for item in hidden:
            run = EFFECTS[item.effect].apply(run, item)
        record = run.run()
        rng = stream(seed, f"noise {i}")
        quantum = 2 * np.pi / (run.controller.counts * run.plant.machine.ratio)
        columns[name] = measure(robot, record, run.sensors, run.plan.log_from, quantum, rng)
        flawless = replace(run.sensors, noise=NO_NOISE)
        exact[name] = measure(robot, record, flawless, run.plan.log_from, 1e-15, rng)
        facts[name] = _facts(run, record)
    truth = {
        "seed": seed,
        "motion": motion,
        "noise": noise,
        "alternative": ALTERNATIVE,
        "hidden": [item.as_dict(in_catalogue=EFFECTS[item.effect].in_catalogue) for item in hidden],
        "noise_torque_Nm": ref.noise_torque,
        "tolerances": tolerances,
        "logs": facts,
    }
    return Trial(robot.spec, columns, exact, truth)


def plan_of(robot: Robot, seed: int, index: int) -> Plan:
    """The motion of a trial's first, second, ... log: other speeds, other sections."""
    rng = stream(seed, f"motion {index}")
    if robot.floating:
        first, second = rng.uniform(2.9, 3.4), rng.uniform(4.0, 5.0)
        return walking_plan(robot, periods=(first, second) if index % 2 == 0 else (second,))
    if index % 2 == 0:
        return leg_plan(robot, rng)
    return leg_plan(robot, rng, speed=0.8, sections=("fast", "slow", "steps"))


def _facts(setup: Setup, record: Record) -> dict[str, Any]:
    """What is worth knowing of a run besides its log."""
    facts: dict[str, Any] = {
        "duration_s": setup.plan.duration,
        "energy_imbalance": record.imbalance,
        "step_s": record.dt,
        "peak_voltage_V": float(np.abs(record.voltage).max()),
        "final_temperature_rise_K": record.temperature_rise[-1].tolist(),
    }
    if record.foot_force is not None:
        robot, force = setup.plant.robot, record.foot_force
        loaded = force[..., 2] > 1.0
        count = np.maximum(loaded.sum(axis=1), 1)
        share = (force[..., :2] * loaded[..., None]).sum(axis=1) / count[:, None]
        squeeze = np.where(loaded[..., None], force[..., :2] - share[:, None], 0.0)
        # How hard the ground pushes either side's feet outward, averaged over time.
        side = np.array([1.0 if leg.side == "left" else -1.0 for leg in robot.spec.legs])
        facts["outward_force_N"] = float(0.5 * (force[..., 1] @ side).mean())
        facts["internal_tangential_force_N"] = float(np.sqrt(np.mean(squeeze[loaded] ** 2)))
    return facts
