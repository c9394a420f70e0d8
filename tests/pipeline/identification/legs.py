"""Robots that walk and stand in MuJoCo, one thing hidden: logs for `gap`, and who found what.

python -m tests.pipeline.identification.legs --out DIR [--only hexapod] [--hidden payload]
"""

import argparse
import re
import time
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from actuators.errors import LegwattError
from pipeline.identification.workflow.compared import load_logs
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.equations import with_known_motion
from tests.command_line import as_compared
from tests.pipeline.dynamics.walking_engine import Walked, walked

#: Servo's stiffness, share of the hexapod's torque, periods of its cycles.
ROBOTS = {
    "hexapod": (1500.0, 1.0, (3.0, 3.4, 4.2, 2.6, 3.2, 3.8, 2.8, 4.0)),
    "solo12": (60.0, 0.05, (1.7, 2.0, 1.5, 1.8, 2.2, 1.6, 1.9, 2.1)),
    "anymal_c": (2000.0, 1.0, (2.7, 3.0, 2.5, 2.8, 3.2, 2.6, 2.9, 3.1)),
}
HIDDEN = ("nothing", "payload", "centre", "tilt", "gain", "coulomb")
KINDS = ("forces", "flags", "neither")
#: What names it: effects, and what of the place.
RIGHT = {
    "payload": r"link_mass.*base|rigid_body_parameters.*base",
    "centre": r"(center_of_mass_offset|rigid_body_parameters|link_mass).*base|base_tilt",
    "tilt": r"base_tilt|(center_of_mass_offset).*base",
    "gain": r"(torque_gain|torque_constant_error|effort_gain|gain).*{third}",
    "coulomb": r"coulomb_friction",
}


def robot_of(name: str) -> Robot:
    return load_robot(load_robot_file(Path("urdf") / f"{name}.toml"))


def made(name: str, hidden: str, motion: str) -> Walked:
    """A log with one thing hidden."""
    robot, (kp, size, periods) = robot_of(name), ROBOTS[name]
    mass = sum(body.mass for body in robot.model.inertias)
    own: dict[str, Any] = {
        "nothing": {},
        "payload": {"payload": (0.075 * mass, (0.12 if size == 1.0 else 0.04, 0.03, 0.0))},
        "centre": {"centre": 0.03 if size == 1.0 else 0.01},
        "tilt": {"tilt": 0.06},
        "gain": {"gain": {robot.joints[2]: 0.9}},
        "coulomb": {"coulomb": dict.fromkeys(robot.joints[1::3], 2.0 * size)},
    }[hidden]
    walks = {"periods": periods} if motion == "walk" else {"squats": 24.0}
    return walked(robot, **walks, **own, kp=kp, noise=0.15 * size)


def frame_of(robot: Robot, log: Walked, kind: str) -> pd.DataFrame:
    """Columns of a log with foot forces, contact flags, or neither and no orientation."""
    out = {"time_s": log.time}
    for j, joint in enumerate(robot.joints):
        out[f"{joint}__position_rad"] = log.q[:, j]
        out[f"{joint}__torque_Nm"] = log.torque[:, j]
    if kind == "neither":
        return pd.DataFrame(out)
    yaw, pitch, roll = Rotation.from_quat(log.orientation).as_euler("ZYX").T
    out |= {"base__roll_rad": roll, "base__pitch_rad": pitch}
    weight = 9.81 * sum(body.mass for body in robot.model.inertias)
    ahead = Rotation.from_euler("Z", -yaw[:, None])
    rng = np.random.default_rng(3)
    for k, leg in enumerate(robot.spec.legs):
        force = ahead.apply(log.force[:, k])
        if kind == "forces":
            force = force + rng.normal(0.0, 0.0025 * weight, force.shape)
            out |= {f"{leg.foot}__force_{a}_N": force[:, i] for i, a in enumerate("xyz")}
        else:
            out[f"{leg.foot}__contact"] = (log.force[:, k, 2] > 0.01 * weight).astype(float)
    return pd.DataFrame(out)


def log_of(
    name: str, robot: Robot, walk: Walked, kind: str, folder: Path
) -> tuple[MachineModel, Log]:
    """A log as `gap` reads it, and the machine by its files."""
    path = folder / f"{name}_{kind}.parquet"
    frame_of(robot, walk, kind).to_parquet(path)
    order, given = as_compared(path, robot=Path("urdf") / f"{name}.toml", step="where", cutoff=8.0)
    return given.bare_model, with_known_motion(given.bare_model, load_logs(given, order).logs[0])


def judged(robot: Robot, hidden: str, found: pd.DataFrame) -> str:
    """right, missed, wrong, or wrong and confirmed; of nothing: right where nothing is named.

    A class is right where one of its members is.
    """
    told = found[found["written"] == True] if len(found) else found  # noqa: E712
    if len(told):  # bodies are one name, at all links whose tolerances moved beside a loose one
        places = told.groupby(["effect", "order"])["place"].transform(
            lambda p: " ".join(p.unique())
        )
        told = told.assign(place=places).drop_duplicates(["effect", "place"])
    pattern = RIGHT.get(hidden, "$^").format(third=robot.joints[2])
    names = [f"{r.effect} {r.place}: {r.reason}" for r in told.itertuples()]
    good = [bool(re.search(pattern, n)) for n in names]
    sure = [r.level == "confirmed" for r in told.itertuples()]
    if any(s and not g for g, s in zip(good, sure, strict=True)):
        return "wrong and confirmed"
    if hidden == "nothing":
        return "wrong" if names else "right"
    return "right" if any(good) else "wrong" if names else "missed"


def main() -> None:
    from pipeline.commands.gap import gap
    from pipeline.commands.robots import load

    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    choices = {"only": ROBOTS, "hidden": HIDDEN, "motions": ("walk", "stand"), "kinds": KINDS}
    for name, every in choices.items():
        parser.add_argument(f"--{name}", nargs="+", default=[*every])
    asked = vars(parser.parse_args())
    out: Path = asked.pop("out")
    out.mkdir(parents=True, exist_ok=True)
    rows, walk = [], lru_cache(maxsize=1)(made)
    for name, hidden, motion, kind in product(*(asked[key] for key in choices)):
        robot, path = robot_of(name), out / f"{name}_{hidden}_{motion}_{kind}.parquet"
        if not path.is_file():
            frame_of(robot, walk(name, hidden, motion), kind).to_parquet(path)
        begun = time.process_time()
        try:
            found = gap(path, load(Path("urdf") / f"{name}.toml")).found
            verdict = judged(robot, hidden, found)
            names = (f"{r.effect} {r.place}, {r.level}: {r.reason}" for r in found.itertuples())
            said = "; ".join(dict.fromkeys(names))
        except LegwattError as error:
            verdict, said = "refused", str(error)
        took = round(time.process_time() - begun, 1)
        rows.append((name, hidden, motion, kind, verdict, took, said[:600]))
        print(*rows[-1], sep=" | ", flush=True)
    columns = ["robot", "hidden", "motion", "kind", "verdict", "cpu_s", "said"]
    pd.DataFrame(rows, columns=columns).to_csv(out / "legs.csv", index=False)


if __name__ == "__main__":
    main()
