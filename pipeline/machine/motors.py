"""Whose motors a machine is computed with, and what they weigh."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from actuators.loading.build import Catalog
from pipeline.machine.joint import Actuators, drivetrains_of
from pipeline.machine.own_actuators import AS_BUILT, OwnActuators


@dataclass(frozen=True)
class Motors:
    """The motors of all joints, of all alternatives that count."""

    titles: tuple[str, ...]  #: Of the motors' files, each once.
    joints: int  #: How many joints have one.
    ratio: tuple[float, float]  #: Least and greatest motor speed over joint speed [1].
    #: Least and greatest mass of one motor [kg]; 0 where a file does not state it.
    mass: tuple[float, float]
    total: float  #: Greatest mass of all joints' motors [kg]; 0 where one is not stated.
    robot: float  #: Mass of the robot [kg].
    #: Whether robot file or command line say which motors these are; assumed otherwise.
    stated: bool

    @property
    def too_heavy(self) -> bool:
        """Whether the motors alone weigh more than the robot whose joints they drive."""
        return self.total > self.robot


def motors_of(
    catalog: Catalog,
    own: OwnActuators,
    every: Mapping[str, Actuators],
    names: Iterable[str],
    robot: float,
    *,
    stated: bool,
) -> Motors:
    """The motors of a machine.

    `robot`: mass of the robot [kg]. `stated`: whether the catalogue is the user's; what the robot
    file states is stated, too.
    """
    joints = tuple(names)
    usual = own.usual if own.usual in every else ""
    counted = {usual: every[usual]} if usual else every
    rows = [drivetrains_of(actuators, joints).joints for actuators in counted.values()]
    masses = np.array([[j.motor.mass if j.motor else 0.0 for j in row] for row in rows])
    ratios = [j.ratio for row in rows for j in row]
    built = {*own.built.values(), own.alternative} - {""} if usual == AS_BUILT else counted
    titles = (catalog.components[catalog.alternatives[name].motor].title for name in built)
    return Motors(
        titles=tuple(dict.fromkeys(titles)),
        joints=len(joints),
        ratio=(min(ratios), max(ratios)),
        mass=(float(masses.min()), float(masses.max())),
        total=float(masses.sum(axis=1).max()) if (masses > 0).all() else 0.0,
        robot=robot,
        stated=stated or bool(own or own.source),
    )
