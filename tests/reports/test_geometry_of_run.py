"""Every figure of a run: no text cut, on another, or crossed by a line; letters large enough."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from pipeline.api.figures import Drawings, drawings
from pipeline.api.pictures.scene import Scene
from pipeline.cli.main import parser
from pipeline.cli.options import settings_of
from pipeline.simulation.walk_stand import stand, walk
from reports.pages.robot_words import leg_words
from tests.reports import geometry

NAMES = (
    *("gait", "robot", "zero_pose", "electrical_energy", "joint_torques", "ground_forces"),
    "electrical_energy_narrow",
    *(
        f"{kind}_{alternative}"
        for kind in ("actuator_chain", "motor_limits", "stage_energy")
        for alternative in ("ideal", "rotor", "reversible", "irreversible")
    ),
    *(f"joint_demand_rm_joint_{k}" for k in (1, 2, 3)),
)


def run(robot: Path) -> Drawings:
    given = settings_of(parser().parse_args(["reports", "--robot", str(robot), "--samples", "151"]))
    standing = stand(given.machine, given.chains())
    walking = walk(given.machine, given.chains(), samples=given.samples)
    return drawings(Scene(given.robot), given, standing, walking)


@pytest.fixture(scope="module")
def figures(root: Path) -> Drawings:
    return run(root / "urdf" / "hexapod.toml")


def objections(draw: Callable[[], Figure]) -> list[object]:
    figure = draw()
    small = geometry.smallest_letters(figure)
    return [
        *geometry.outside(figure),
        *geometry.overlapping(figure),
        *geometry.crossed(figure),
        *([f"letters of {small:.1f} px"] if small < 11.0 else []),
    ]


@pytest.mark.parametrize("name", NAMES)
def test_nothing_to_object_to(figures: Drawings, name: str) -> None:
    assert objections(figures[name]) == []


def test_every_figure_is_measured(figures: Drawings) -> None:
    assert set(figures) == set(NAMES)


@pytest.mark.slow
def test_nothing_to_object_to_with_the_other_axis(root: Path) -> None:
    for name, draw in run(root / "urdf" / "hexapod_axis90.toml").items():
        assert objections(draw) == [], name


def test_leg_names_are_explained() -> None:
    assert leg_words("rm") == "middle right leg (rm)"
    assert leg_words("lf") == "front left leg (lf)"
    assert leg_words("leg3") == "leg leg3"
