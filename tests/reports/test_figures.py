"""Figures show what they were given: axes, lines, labels, and the same bytes every time.

Warnings are errors, so that a missing glyph or a failed layout is found here.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from actuators.energy.energy import StageEnergy
from actuators.errors import LegwattError
from actuators.shaft import DCMotor, ShaftSeries
from reports.figures.bars import (
    day_figure,
    electrical_energy_figure,
    energy_limits,
    stage_energy_figure,
)
from reports.figures.demand import (
    Stretch,
    ground_forces_figure,
    joint_demand_figure,
    joint_torques_figure,
)
from reports.figures.gait import gait_figure
from reports.figures.lines import BreakEven, energy_per_minute_figure
from reports.figures.motor_limits import motor_limits_figure
from reports.figures.style import BLUE, VERMILION, save_figure, save_figures
from reports.typeset import number
from tests.reports.outside import outside


def stretch(
    time: np.ndarray, legs: Sequence[str], stance: Sequence[str], joints: int = 1, **given: object
) -> Stretch:
    """A stretch of zeros but for what is given."""
    n, count = len(time), len(legs)
    columns = {"velocity": joints, "torque": joints, "normal": count, "friction": count}
    values: dict[str, object] = {name: np.zeros((n, size)) for name, size in columns.items()}
    values |= {"feet": np.zeros((n, count, 3)), "mass_centre": np.zeros((n, 3))}
    values |= {"margin": np.full(n, 0.05)} | given
    return Stretch(time=time, stance=tuple(stance), **values)  # type: ignore[arg-type]


def crawl() -> list[Stretch]:
    """Four feet, one of which swings in each stretch."""
    legs = ("lf", "rf", "lh", "rh")
    out = []
    for k in range(4):
        t = np.linspace(k, k + 1, 21)
        feet = np.zeros((21, 4, 3))
        feet[..., :2] = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]]
        phase = (t[:, None] - np.arange(4)) % 4
        feet[..., 0] += np.where(phase < 1, -0.06 + 0.12 * phase, 0.06 - 0.04 * (phase - 1))
        feet[:, k, 2] = 0.05 * np.sin(np.pi * (t - k))
        margin = 0.02 + 0.01 * k + 0.01 * np.cos(t)
        stance = [name for i, name in enumerate(legs) if i != k]
        out.append(stretch(t, legs, stance, feet=feet, margin=margin))
    return out


def part(first: float, velocity: object, torque: float | np.ndarray, stands: bool):
    """One joint of leg `l` for 1.5 s."""
    time = np.linspace(first, first + 1.5, 5)
    columns = {"velocity": velocity, "torque": torque}
    given = {name: np.full((5, 1), np.reshape(v, (-1, 1))) for name, v in columns.items()}
    return stretch(time, ["l"], ["l"] * stands, **given)


PARTS = (part(0, -1.0, -30.0, True), part(1.5, np.linspace(-1, 1, 5), 2.0, False))
JOINTS = {"a": "joint 1", "b": "joint 2"}


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


def demand(parts=PARTS, **more: object):
    return joint_demand_figure(parts, 0, "l", title="t", **more)


def curves(axes) -> list[np.ndarray]:
    return [np.asarray(x.get_ydata()) for x in axes.lines if len(x.get_xdata()) == 5]


def test_joint_demand_draws_a_jump_as_a_jump_and_shades_support() -> None:
    figure = demand()
    velocity, torque = figure.axes
    assert [float(curve[0]) for curve in curves(torque)] == [-30.0, 2.0]
    assert velocity.get_ylabel() == "velocity [rad/s]"
    assert torque.get_ylabel() == "torque [N·m]"
    assert torque.get_xlim() == (0.0, 3.0)
    for axes in figure.axes:
        (patch,) = axes.patches
        assert (patch.get_x(), patch.get_x() + patch.get_width()) == (0.0, 1.5)
    assert "\N{MINUS SIGN}30 N·m" in texts(figure)
    assert {"velocity [m/s]", "force [N]"} <= set(texts(demand(slides=True)))


PLACES = {"out": "joint", "el": "supply"}
STAGES = [
    StageEnergy("out", ("a", "b"), np.array([0.3, 2.6]), np.array([0.3, 2.6])),
    StageEnergy("el", ("a", "b"), np.array([1.5, 9.0]), np.array([0.0, 0.2])),
]


def test_stage_energy_bars_are_the_energies() -> None:
    figure = stage_energy_figure(STAGES, JOINTS, places=PLACES, title="Alternative")
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["joint 1", "joint 2"]
    heights = [p.get_height() for p in figure.axes[1].patches]
    assert heights == [2.6, 9.0, -2.6, -0.2]
    words = texts(figure)
    assert "9" in words
    assert any(word.endswith("supply") for word in words)


def test_stage_energies_of_all_alternatives_share_one_scale() -> None:
    smaller = [replace(s, forward=s.forward / 9, reverse=4 * s.reverse) for s in STAGES]
    limits = energy_limits([STAGES, smaller], JOINTS)
    assert limits == (9.0, 10.4)
    ranges = {
        stage_energy_figure(stages, JOINTS, places=PLACES, title="t", limits=limits)
        .axes[0]
        .get_ylim()
        for stages in (STAGES, smaller)
    }
    ((low, high),) = ranges
    assert low < -10.4
    assert high > 9.0


def test_electrical_energy_is_stacked_and_compared_with_the_reference() -> None:
    energies = {"ideal": np.array([1.0, 4.0]), "real": np.array([20.0, 30.0])}
    joints = ["joint 1", "joint 2"]
    figure = electrical_energy_figure(joints, energies, reference="ideal", title="t")
    (axes,) = figure.axes
    assert [p.get_width() for p in axes.patches] == [1.0, 20.0, 4.0, 30.0]
    shown = [word for word in texts(figure) if word.endswith("\N{MULTIPLICATION SIGN}")]
    assert shown == ["real: 50 J, 10 \N{MULTIPLICATION SIGN}"]
    figure = electrical_energy_figure(joints, energies, reference=None, title="t")
    assert not any("\N{MULTIPLICATION SIGN}" in word for word in texts(figure))


def test_a_day_is_stacked_of_its_losses() -> None:
    losses = {"windings": np.array([3.0, 1.0]), "drivers": np.array([2.0, 2.5])}
    figure = day_figure(["walk", "stand"], losses, [4.0, 20.0])
    bars = [(p.get_x(), p.get_width()) for p in figure.axes[0].patches]
    assert bars == [(0.0, 3.0), (0.0, 1.0), (3.0, 2.0), (1.0, 2.5)]
    assert "walk, 4 h: 5 Wh" in texts(figure)


MOTOR = DCMotor("m", 0.0302, 0.316, 1200.0, 24.0, 5.77, 75.0)
MOTORS = [MOTOR, MOTOR]
SUPPORT = [(0.0, 1.0)]


def shaft(factor: float = 1.0) -> ShaftSeries:
    time = np.array([0.0, 1.0, 1.0, 2.0])
    zeros = np.zeros((4, 2))
    velocity = np.array([[100.0, 1.0], [200.0, 2.0], [-200.0, 1.0], [-100.0, 1.0]])
    return ShaftSeries.at_joint(
        ("a", "b"), time, zeros, factor * velocity, zeros, 0.05 * factor + zeros
    )


def colored(axes, color: str) -> list[np.ndarray]:
    return [line.get_xydata() for line in axes.lines if line.get_color() == color]


def test_motor_path_is_whole_and_its_phases_are_told_apart() -> None:
    figure = motor_limits_figure(shaft(), MOTORS, JOINTS, SUPPORT, title="t")
    panel = figure.axes[0]
    ((support,), (transfer,)) = colored(panel, BLUE), colored(panel, VERMILION)
    rpm = 60 / (2 * np.pi)
    np.testing.assert_allclose(support, [[100 * rpm, 50.0], [200 * rpm, 50.0]])
    np.testing.assert_allclose(transfer, [[-200 * rpm, 50.0], [-100 * rpm, 50.0]])


def test_motor_limits_states_every_limit_and_the_rms() -> None:
    figure = motor_limits_figure(shaft(), MOTORS, JOINTS, SUPPORT, title="t")
    words = texts(figure)
    for expected in (
        "supply: 24 V",
        "permitted: 11460 rpm",
        "continuous: 174 mN·m",
        "peak: 2265 mN·m",
        "joint 1: rms 50 of 174 mN·m",
    ):
        assert expected in words


def test_motor_without_limits() -> None:
    figure = motor_limits_figure(shaft(), [DCMotor("m", 0.03, 0.3)] * 2, JOINTS, SUPPORT, title="t")
    words = texts(figure)
    assert not any(word.startswith(("supply", "peak", "permitted", "continuous")) for word in words)
    assert "joint 1: rms 50 mN·m" in words
    figure = motor_limits_figure(shaft(400.0), [DCMotor("m", 0.03, 0.3)] * 2, JOINTS, [], title="t")
    assert figure.axes[0].get_ylabel() == "motor torque [N·m]"
    assert "joint 2: rms 20 N·m" in texts(figure)


def test_energy_per_minute_with_and_without_break_even() -> None:
    share = np.linspace(0, 1, 11)
    names = {"reversible": "can be driven back", "irreversible": "locks"}
    lines = pd.DataFrame({"standing_fraction": np.tile(share, 2)})
    lines["alternative"] = np.repeat(["reversible", "irreversible"], 11)
    lines["energy_J"] = np.append(100 - 90 * share, 150 - 150 * share)
    lines["prior_low_J"], lines["prior_high_J"] = (
        np.append(end - 90 * share, np.full(11, np.nan)) for end in (95, 105)
    )
    lines["left_out_low_J"] = lines["left_out_high_J"] = np.nan
    mark = BreakEven(5 / 6, 25.0, (0.8, 0.86))
    figure = energy_per_minute_figure(lines, names, title="t", break_even=mark)
    assert len(figure.axes) == 2
    assert any("break-even 83.3 %" in word for word in texts(figure))
    assert len(energy_per_minute_figure(lines, names, title="t").axes) == 1


LEGS = ("a", "b", "c", "d")


def four(first: float, joints: int, legs: tuple[str, ...], stance: tuple[str, ...]):
    """A second of a robot of several legs."""
    time = np.linspace(first, first + 1, 11)
    torque = np.sin(time[:, None] + np.arange(joints))
    normal = np.tile([float(one in stance) for one in legs], (11, 1))
    friction = np.where(normal > 0, 0.1, np.nan)
    given = {"torque": torque, "normal": normal, "friction": friction}
    return stretch(time, legs, stance, joints, **given, margin=np.full(11, 0.03))


@pytest.mark.parametrize(("count", "depth"), [(2, 7), (4, 2), (8, 7)])
def test_every_joint_has_a_line_in_the_panel_of_its_place(count: int, depth: int) -> None:
    legs = {f"l{i}": [f"l{i}_{k}" for k in range(depth)] for i in range(count)}
    joints = [joint for own in legs.values() for joint in own]
    names = tuple(legs)
    parts = [four(0, len(joints), names, names), four(1, len(joints), names, names[1:])]
    figure = joint_torques_figure(parts, joints, legs, title="t")
    assert len(figure.axes) == depth
    for k, axes in enumerate(figure.axes):
        lines = [line for line in axes.lines if len(line.get_xdata()) == 11]
        assert len(lines) == 2 * count
        np.testing.assert_array_equal(lines[0].get_ydata(), parts[0].torque[:, k])
    assert outside(figure) == []
    thin = min(line.get_linewidth() for line in figure.axes[0].lines)
    assert thin < 1  # the first leg is in the air in the second stretch


def test_legs_of_unequal_length_and_joints_outside_legs_have_their_place() -> None:
    legs = {"a": ["a1", "a2", "a3"], "b": ["b1", "b2"]}
    joints = ["a1", "a2", "a3", "b1", "b2", "arm"]
    only = four(0, 6, ("a", "b"), ("a",))
    figure = joint_torques_figure([only], joints, legs, sliding=["a3"], title="t")
    lines = [[x for x in axes.lines if len(x.get_xdata()) == 11] for axes in figure.axes]
    assert [len(found) for found in lines] == [2, 2, 1, 1]
    np.testing.assert_array_equal(lines[3][0].get_ydata(), only.torque[:, 5])
    assert "force [N]" in figure.axes[2].get_ylabel()
    assert "arm" in texts(figure.legends[0])


def test_ground_forces_state_the_least_margin() -> None:
    parts = [four(0, 1, LEGS, LEGS), four(1, 1, LEGS, LEGS[1:])]
    figure = ground_forces_figure(parts, LEGS, title="t")
    np.testing.assert_array_equal(figure.axes[0].lines[0].get_ydata(), parts[0].normal[:, 0])
    assert any("least margin 30 mm" in word for word in texts(figure))


def test_a_gait_of_many_stances_shows_the_least_stable_instant_of_each() -> None:
    body = np.array([[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.3, 0.1]])
    parts = crawl()
    figure = gait_figure(("lf", "rf", "lh", "rh"), parts, shown="rh", body=body, title="t")
    words = texts(figure)
    assert sum(word.startswith("least stable") for word in words) == 4
    for one in parts:
        least = f"margin {number(1e3 * float(one.margin.min()))} mm"
        assert any(word.endswith(least) for word in words)
    assert any("stroke 120 mm,\nheight 50 mm" in word for word in words)
    bars = [bar for bar in figure.axes[-1].patches if isinstance(bar, Rectangle)]
    assert sum(bar.get_width() for bar in bars) == pytest.approx(12.0)  # three of four stand
    assert outside(figure) == []
    for shown, legs in (("nobody", "not among"), ("rh", "both stand and swing")):
        with pytest.raises(LegwattError, match=legs):
            gait_figure(("lf", "rf", "lh", "rh"), parts[:1], shown=shown, body=body, title="t")


def test_same_figure_same_bytes_and_no_trace_of_the_machine(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        save_figure(demand(), tmp_path / folder, "f")
    first = (tmp_path / "one" / "f.svg").read_bytes()
    assert first == (tmp_path / "two" / "f.svg").read_bytes()
    assert str(tmp_path).encode() not in first
    assert first.startswith(b"<?xml")
    assert b"<dc:date>" not in first


def fail() -> None:
    raise LegwattError("nothing to draw")


def test_an_error_in_a_figure_is_that_error(tmp_path: Path) -> None:
    with pytest.raises(LegwattError, match="nothing to draw"):
        save_figures({"demand": demand, "bad": fail}, tmp_path)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_drawing_leaves_global_settings_alone() -> None:
    # Not `dict(rcParams)`: to read the backend's name would choose one, and load pyplot for it.
    before = matplotlib.rcParams.copy()
    demand()
    assert matplotlib.rcParams.copy() == before
    assert "matplotlib.pyplot" not in sys.modules
