"""Usual mistakes of URDFs are told from a log, and none where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.effects.bodies import point_mass
from pipeline.identification.workflow.mistakes import mistaken
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from tests.pipeline.identification.test_unnamed import log_of, model  # noqa: F401


def stated(true: MachineModel, change) -> MachineModel:  # type: ignore[no-untyped-def]
    """The model of a URDF with a mistake in every link."""
    rigid = true.rigid.copy()
    for joint in true.links.values():
        k = rigid.getJointId(joint)
        rigid.inertias[k] = change(pin.Inertia(rigid.inertias[k]))
    return replace(true, rigid=rigid)


def about_joint(b: pin.Inertia) -> pin.Inertia:
    more = np.r_[np.zeros(4), point_mass(b.mass, b.lever)[4:]]
    return pin.Inertia.FromDynamicParameters(np.asarray(b.toDynamicParameters()) + more)


@pytest.fixture(scope="module")
def log(model: MachineModel) -> Log:  # noqa: F811
    return log_of(model, seconds=8.0, pace=4.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (about_joint, "inertias about the joint"),
        (
            lambda b: pin.Inertia(b.mass, b.lever, 1e4 * b.inertia),
            "inertias in another unit",
        ),
        (lambda b: pin.Inertia(b.mass, b.lever, np.eye(3)), "placeholders"),
    ],
)
def test_a_mistake_is_told(model: MachineModel, log: Log, change, words: str) -> None:  # type: ignore[no-untyped-def] # noqa: F811
    found = mistaken(stated(model, change), [log])
    assert found is not None
    assert found.words.startswith(words)


def test_none_is_told_where_there_is_none(model: MachineModel, log: Log) -> None:  # noqa: F811
    assert mistaken(model, [log]) is None
