"""Figures show what they were given: axes, lines, labels, and the same bytes every time.

Warnings are errors, so that a missing glyph or a failed layout is found here.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from actuators.energy import StageEnergy
from actuators.motor import DCMotor
from actuators.shaft import ShaftSeries
from pipeline.joint_demand import MotionDemand
from reports.errors import FigureError
from reports.figures.electrical_energy import electrical_energy_figure
from reports.figures.energy_per_minute import BreakEven, EnergyLine, energy_per_minute_figure
from reports.figures.gait_view import GaitStretch, gait_figure
from reports.figures.joint_demand import Stretch, joint_demand_figure, stretches
from reports.figures.motor_limits import motor_limits_figure
from reports.figures.save import save_figure
from reports.figures.stage_energy import stage_energy_figure
from reports.figures.style import number

PARTS = (
    Stretch(np.linspace(0, 1.5, 5), np.full(5, -1.0), np.full(5, -30.0), True),
    Stretch(np.linspace(1.5, 3, 5), np.linspace(-1, 1, 5), np.full(5, 2.0), False),
)
JOINTS = {"a": "joint 1", "b": "joint 2"}


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (-38.0, "\N{MINUS SIGN}38.0"), (1.6, "1.60"), (250.0, "250")]
)
def test_numbers_in_labels(value: float, text: str) -> None:
    assert number(value) == text


def test_joint_demand_draws_a_jump_as_a_jump() -> None:
    figure = joint_demand_figure("rm_joint_2", PARTS)
    velocity, torque = figure.axes
    curves = [line for line in torque.lines if len(line.get_xdata()) == 5]
    assert len(curves) == 2
    assert {float(line.get_ydata()[0]) for line in curves} == {-30.0, 2.0}
    assert velocity.get_ylabel() == "velocity [rad/s]"
    assert torque.get_ylabel() == "torque [N·m]"
    assert torque.get_xlim() == (0.0, 3.0)
    words = texts(figure)
    assert words.count("support") == words.count("transfer") == 1


def test_joint_demand_shades_support_only() -> None:
    figure = joint_demand_figure("j", PARTS)
    for axes in figure.axes:
        (patch,) = axes.patches
        low, high = patch.get_x(), patch.get_x() + patch.get_width()
        assert (low, high) == (0.0, 1.5)


def test_stretches_come_from_the_demand(walk_demand: MotionDemand) -> None:
    support, transfer = stretches(walk_demand, "rm_joint_2", "rm")
    assert (support.support, transfer.support) == (True, False)
    column = walk_demand.joints.index("rm_joint_2")
    np.testing.assert_array_equal(support.torque, walk_demand.segments[0].torque[:, column])
    with pytest.raises(FigureError, match="rm_joint_9"):
        stretches(walk_demand, "rm_joint_9", "rm")
    with pytest.raises(FigureError, match="no stretch"):
        joint_demand_figure("rm_joint_2", [])


STAGES = [
    StageEnergy("out", ("a", "b"), np.array([0.3, 2.6]), np.array([0.3, 2.6])),
    StageEnergy("el", ("a", "b"), np.array([1.5, 9.0]), np.array([0.0, 0.2])),
]


def test_stage_energy_bars_are_the_energies() -> None:
    figure = stage_energy_figure(STAGES, JOINTS, title="Alternative")
    assert [axes.get_title(loc="center") for axes in figure.axes] == ["joint 1", "joint 2"]
    heights = [p.get_height() for p in figure.axes[1].patches]
    assert heights == [2.6, 9.0, -2.6, -0.2]
    words = texts(figure)
    assert "9.00" in words
    assert "supply" in words


def test_stage_energy_takes_a_common_scale() -> None:
    limits = [
        stage_energy_figure(STAGES, {"a": "1"}, title="t", upper=50.0).axes[0].get_ylim()[1],
        stage_energy_figure(STAGES, {"a": "1"}, title="t").axes[0].get_ylim()[1],
    ]
    assert limits[0] > 50 > limits[1]


def test_stage_energy_of_zeros_and_of_unknown_joints() -> None:
    zero = StageEnergy("out", ("a",), np.zeros(1), np.zeros(1))
    assert len(stage_energy_figure([zero], {"a": "joint"}, title="t").axes) == 1
    with pytest.raises(FigureError, match="no joint 'c'"):
        stage_energy_figure(STAGES, {"c": "joint"}, title="t")
    with pytest.raises(FigureError, match="no stage"):
        stage_energy_figure([], JOINTS, title="t")


def test_electrical_energy_is_stacked_and_compared() -> None:
    energies = {"ideal": np.array([1.0, 4.0]), "real": np.array([20.0, 30.0])}
    figure = electrical_energy_figure(["joint 1", "joint 2"], energies, title="t")
    (axes,) = figure.axes
    assert [p.get_width() for p in axes.patches] == [1.0, 4.0, 20.0, 30.0]
    assert any("10.0 \N{MULTIPLICATION SIGN} ideal" in word for word in texts(figure))
    with pytest.raises(FigureError, match="needs 1 values"):
        electrical_energy_figure(["joint 1"], energies, title="t")


MOTOR = DCMotor("m", 0.0302, 0.316, 1200.0, 24.0, 5.77, 75.0)


def shaft() -> ShaftSeries:
    time = np.array([0.0, 1.0, 1.0, 2.0])
    zeros = np.zeros((4, 2))
    velocity = np.array([[100.0, 1.0], [200.0, 2.0], [-200.0, 1.0], [-100.0, 1.0]])
    return ShaftSeries.at_joint(("a", "b"), time, zeros, velocity, zeros, 0.05 + zeros)


def test_motor_limits_draws_blocks_apart_and_says_the_limits() -> None:
    figure = motor_limits_figure(shaft(), MOTOR, JOINTS, title="t")
    assert len(figure.axes) == 2
    words = texts(figure)
    for expected in ("24 V", "11459 rpm", "continuous: 174", "rms 50.0 mN·m"):
        assert expected in words
    paths = [line for line in figure.axes[0].lines if np.allclose(line.get_ydata(), 50.0)]
    assert len(paths) == 2
    with pytest.raises(FigureError, match="no joint 'z'"):
        motor_limits_figure(shaft(), MOTOR, {"z": "joint"}, title="t")


def test_motor_without_limits() -> None:
    figure = motor_limits_figure(shaft(), DCMotor("m", 0.03, 0.3), JOINTS, title="t")
    assert not any("V" in word or "continuous" in word for word in texts(figure))


def gait(legs: tuple[str, ...]) -> list[GaitStretch]:
    time = np.linspace(0, 1.5, 4)
    feet = np.zeros((4, 4, 3))
    feet[:, :, 0] = [0.3, 0.3, -0.3, -0.3]
    feet[:, :, 1] = [0.2, -0.2, 0.2, -0.2]
    feet[:, 3, 2] = [0, 0.05, 0.05, 0]
    feet[:, :, 0] += np.linspace(0.1, -0.1, 4)[:, None]
    centre, margin = np.zeros((4, 3)), np.full(4, 0.05)
    other = feet.copy()
    other[:, 3, 2] = 0
    return [
        GaitStretch(time, feet, legs[:3], centre, margin),
        GaitStretch(time + 1.5, other, legs[1:], centre, margin),
    ]


def test_gait_view_states_margins_and_measures_the_path() -> None:
    legs = ("lf", "rf", "lr", "rr")
    figure = gait_figure(legs, gait(legs), shown="rr", body=(0.6, 0.2), title="t")
    assert len(figure.axes) == 6
    words = texts(figure)
    assert "200 mm" in words
    assert "50 mm" in words
    assert sum("stability margin 50.0 mm" in word for word in words) == 3
    with pytest.raises(FigureError, match="both stand and swing"):
        gait_figure(legs, gait(legs), shown="rf", body=(0.6, 0.2), title="t")
    with pytest.raises(FigureError, match="'xx'"):
        gait_figure(legs, gait(legs), shown="xx", body=(0.6, 0.2), title="t")


def test_energy_per_minute_with_and_without_break_even() -> None:
    share = np.linspace(0, 1, 11)
    lines = [
        EnergyLine("reversible", 100 - 90 * share, 95 - 90 * share, 105 - 90 * share),
        EnergyLine("irreversible", 150 - 150 * share),
    ]
    mark = BreakEven(5 / 6, 25.0, 0.8, 0.86)
    figure = energy_per_minute_figure(share, lines, title="t", break_even=mark)
    assert len(figure.axes) == 2
    assert any("break-even 83.3 %" in word for word in texts(figure))
    assert len(energy_per_minute_figure(share, lines, title="t").axes) == 1
    with pytest.raises(FigureError, match="needs 3 values"):
        energy_per_minute_figure(share[:3], lines, title="t")


def test_same_figure_same_bytes_and_no_trace_of_the_machine(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        save_figure(joint_demand_figure("j", PARTS), tmp_path / folder, "f")
    for name in ("f.png", "f.svg"):
        first = (tmp_path / "one" / name).read_bytes()
        assert first == (tmp_path / "two" / name).read_bytes()
        assert str(tmp_path).encode() not in first
    assert b"<dc:date>" not in (tmp_path / "one" / "f.svg").read_bytes()
    with pytest.raises(FigureError, match="format 'bmp'"):
        save_figure(joint_demand_figure("j", PARTS), tmp_path, "f", formats=("bmp",))


def test_drawing_leaves_global_settings_alone() -> None:
    before = dict(matplotlib.rcParams)
    joint_demand_figure("j", PARTS)
    assert dict(matplotlib.rcParams) == before
    assert "matplotlib.pyplot" not in sys.modules
