"""Published quadrupeds as robot files, in the stance that their makers name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from pipeline.robot.published import published_robot
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

#: Legs, joints of a leg and its foot, with the leg's name for the braces.
_SOLO = ("FL HL FR HR", "{}_HAA {}_HFE {}_KFE", "{}_FOOT")
_DOG = ("FL RL FR RR", "{}_hip_joint {}_thigh_joint {}_calf_joint", "{}_foot")
QUADRUPEDS = {
    "solo12": _SOLO,
    "solo8": ("FL HL FR HR", "{}_HFE {}_KFE", "{}_FOOT"),
    "anymal_c": ("LF LH RF RH", "{}_HAA {}_HFE {}_KFE", "{}_FOOT"),
    "hyq": ("lf lh rf rh", "{}_haa_joint {}_hfe_joint {}_kfe_joint", "{}_foot"),
    "a1": _DOG,
    "go2": _DOG,
    "b1": _DOG,
    "laikago": _DOG,
}
#: Of a leg's joints [rad], where the package has no poses.
_POSE = {"laikago": (0.0, 0.7, -1.4)}


def quadruped(name: str, folder: Path, gait: Mapping[str, Any]) -> Robot:
    """One of `QUADRUPEDS` with a gait, numbers as the file would write them."""
    legs, joints, foot = QUADRUPEDS[name]
    published = published_robot(name)
    model = pin.buildModelFromUrdf(str(published.urdf), pin.JointModelFreeFlyer())
    base = next(str(f.name) for f in list(model.frames)[1:] if f.type == pin.FrameType.BODY)
    q = pin.neutral(model)
    if published.srdf is not None:
        pin.loadReferenceConfigurations(model, str(published.srdf), False)
        q = model.referenceConfigurations[published.pose].copy()
        q[:7] = [0, 0, 0, 0, 0, 0, 1]
    index = {n: model.joints[model.getJointId(n)].idx_q for n in list(model.names)[2:]}
    chains = {leg: [joint.format(leg) for joint in joints.split()] for leg in legs.split()}
    for chain in chains.values():
        for joint, at in zip(chain, _POSE.get(name, ()), strict=False):
            q[index[joint]] = at
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    feet = {leg: data.oMf[model.getFrameId(foot.format(leg))].translation for leg in chains}
    height = float(np.mean([at[2] for at in feet.values()]))
    mass = float(sum(inertia.mass for inertia in model.inertias))
    lines = ["[robot]", f'name = "{name}"', f"urdf = {json.dumps(f'example-robot-data:{name}')}"]
    lines += [f'base_link = "{base}"']
    for leg, chain in chains.items():
        x, y, _ = (float(c) for c in feet[leg])
        lines += [f"[legs.{leg}]", f"joints = {json.dumps(chain)}", f'foot = "{foot.format(leg)}"']
        lines += [f'side = "{"left" if y > 0 else "right"}"', f"neutral_foot = {[x, y, height]}"]
        lines += [f"start_posture = {[round(float(q[index[joint]]), 3) for joint in chain]}"]
    lines += ["[gait]", *(f"{key} = {json.dumps(value)}" for key, value in gait.items())]
    for key, value, unit in (("total_mass", mass, "kg"), ("gravity", 9.81, "m/s^2")):
        lines += [f"[parameters.{key}]", f'value = {value}\nunit = "{unit}"']
        lines += ['basis = "published"\nsource = "the URDF"']
    path = folder / f"{name}.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return load_robot(load_robot_file(path))
