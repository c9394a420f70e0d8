"""Figures show what they were given: axes, lines, labels, and the same bytes every time.

Warnings are errors, so that a missing glyph or a failed layout is found here.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
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
from reports.figures.lines import energy_per_minute_figure
from reports.figures.motor_limits import motor_limits_figure
from reports.figures.style import BLUE, VERMILION, save_figure, save_figures
from tests.reports.outside import outside

JOINTS = {"a": "joint 1", "b": "joint 2"}


def stretch(
    first: float, legs: Sequence[str], stance: Sequence[str], joints: int = 1, **given: object
) -> Stretch:
    """A second of zeros but for what is given."""
    time, count = np.linspace(first, first + 1, 11), len(legs)
    columns = {"velocity": joints, "torque": joints, "normal": count, "friction": count}
    values: dict[str, object] = {name: np.zeros((11, size)) for name, size in columns.items()}
    values |= {"feet": np.zeros((11, count, 3)), "mass_centre": np.zeros((11, 3))}
    values |= {"margin": np.full(11, 0.03)} | given
    return Stretch(time=time, stance=tuple(stance), **values)  # type: ignore[arg-type]


def texts(figure) -> list[str]:
    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


def demand(**more: object):
    down = stretch(0, ["l"], ["l"], torque=np.full((11, 1), -30.0))
    up = stretch(1, ["l"], [], torque=np.full((11, 1), 2.0))
    return joint_demand_figure([down, up], 0, "l", title="t", **more)


def test_joint_demand_draws_a_jump_as_a_jump_and_shades_support() -> None:
    figure = demand()
    velocity, torque = figure.axes
    curves = [x.get_ydata() for x in torque.lines if len(x.get_xdata()) == 11]
    assert [float(curve[0]) for curve in curves] == [-30.0, 2.0]
    assert (velocity.get_ylabel(), torque.get_ylabel()) == ("velocity [rad/s]", "torque [N·m]")
    for axes in figure.axes:
        (patch,) = axes.patches
        assert (patch.get_x(), patch.get_x() + patch.get_width()) == (0.0, 1.0)
    assert "\N{MINUS SIGN}30 N·m" in texts(figure)
    assert {"velocity [m/s]", "force [N]"} <= set(texts(demand(slides=True)))


def test_stage_energy_bars_are_the_energies_on_one_scale() -> None:
    stages = [
        StageEnergy("out", ("a", "b"), np.array([0.3, 2.6]), np.array([0.3, 2.6])),
        StageEnergy("el", ("a", "b"), np.array([1.5, 9.0]), np.array([0.0, 0.2])),
    ]
    limits = energy_limits([stages], JOINTS)
    assert limits == (9.0, 2.6)
    places = {"out": "joint", "el": "supply"}
    figure = stage_energy_figure(stages, JOINTS, places=places, title="t", limits=limits)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["joint 1", "joint 2"]
    assert [p.get_height() for p in figure.axes[1].patches] == [2.6, 9.0, -2.6, -0.2]
    low, high = figure.axes[0].get_ylim()
    assert (low < -2.6, high > 9.0) == (True, True)


def test_energy_is_stacked_and_compared_with_the_reference() -> None:
    energies = {"ideal": np.array([1.0, 4.0]), "real": np.array([20.0, 30.0])}
    figure = electrical_energy_figure(["1", "2"], energies, reference="ideal", title="t")
    assert [p.get_width() for p in figure.axes[0].patches] == [1.0, 20.0, 4.0, 30.0]
    assert "real: 50 J, 10 \N{MULTIPLICATION SIGN}" in texts(figure)
    losses = {"windings": np.array([3.0, 1.0]), "drivers": np.array([2.0, 2.5])}
    figure = day_figure(["walk", "stand"], losses, [4.0, 20.0])
    bars = [(p.get_x(), p.get_width()) for p in figure.axes[0].patches]
    assert bars == [(0.0, 3.0), (0.0, 1.0), (3.0, 2.0), (1.0, 2.5)]


def motor_paths(motor: DCMotor):
    time = np.array([0.0, 1.0, 1.0, 2.0])
    velocity = np.array([[100.0, 1.0], [200.0, 2.0], [-200.0, 1.0], [-100.0, 1.0]])
    zeros = np.zeros((4, 2))
    shaft = ShaftSeries.at_joint(("a", "b"), time, zeros, velocity, zeros, 0.05 + zeros)
    support = [(0.0, 1.0)]
    return motor_limits_figure(shaft, [motor] * 2, JOINTS, support, title="t")


def test_a_motors_path_is_told_apart_by_phase_within_its_limits() -> None:
    figure = motor_paths(DCMotor("m", 0.0302, 0.316, 1200.0, 24.0, 5.77, 75.0))
    rpm = 60 / (2 * np.pi)
    for color, ends in ((BLUE, (100, 200)), (VERMILION, (-200, -100))):
        (line,) = [x for x in figure.axes[0].lines if x.get_color() == color]
        np.testing.assert_allclose(line.get_xydata(), [[end * rpm / 1e3, 0.05] for end in ends])
    limits = {"supply: 24 V", "permitted: 11460 rpm", "continuous: 0.174 N·m", "peak: 2.265 N·m"}
    assert limits | {"joint 1\nrms 0.05 of 0.174"} <= set(texts(figure))
    words = " ".join(texts(motor_paths(DCMotor("m", 0.03, 0.3))))
    assert not any(limit in words for limit in ("supply", "peak", "permitted", "continuous"))


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
    mark = {"standing_fraction": 5 / 6, "prior_low": 0.8, "prior_high": 0.86}
    figure = energy_per_minute_figure(lines, names, title="t", crossing=mark)
    assert len(figure.axes) == 2
    (bar,) = [x for x in figure.axes[0].lines if len(x.get_xdata()) == 2]
    assert [*bar.get_ydata()] == [95, 105]
    assert any("break-even 83.3 %" in word for word in texts(figure))
    assert len(energy_per_minute_figure(lines, names, title="t").axes) == 1


@pytest.mark.parametrize(("count", "depth"), [(2, 7), (4, 2)])
def test_every_joint_has_a_line_in_the_panel_of_its_place(count: int, depth: int) -> None:
    """A joint outside the legs, too; a line is thin while its leg is in the air."""
    legs = {f"l{i}": [f"l{i}_{k}" for k in range(depth)] for i in range(count)}
    joints = [*(joint for own in legs.values() for joint in own), "arm"]
    names = tuple(legs)
    torque = np.sin(np.arange(11)[:, None] + np.arange(len(joints)))
    parts = [
        stretch(at, names, names[at:], len(joints), torque=torque, margin=np.full(11, 0.03))
        for at in (0, 1)
    ]
    figure = joint_torques_figure(parts, joints, legs, sliding=["arm"], title="t")
    assert len(figure.axes) == depth + 1
    for k, axes in enumerate(figure.axes[:-1]):
        lines = [line for line in axes.lines if len(line.get_xdata()) == 11]
        assert len(lines) == 2 * count
        np.testing.assert_array_equal(lines[0].get_ydata(), torque[:, k])
    assert min(line.get_linewidth() for line in figure.axes[0].lines) < 1
    assert "force [N]" in figure.axes[-1].get_ylabel()
    assert outside(figure) == []
    assert "least margin 30 mm" in " ".join(texts(ground_forces_figure(parts, names, title="t")))


def test_a_gait_shows_the_least_stable_instant_of_each_set_of_feet() -> None:
    legs, parts = ("lf", "rf", "lh", "rh"), []
    corners = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]]
    for k in range(4):
        feet = np.zeros((11, 4, 3))
        feet[..., :2] = corners
        stance = [name for i, name in enumerate(legs) if i != k]
        margin = 0.02 + 0.01 * k + np.linspace(0, 0.01, 11)
        parts.append(stretch(k, legs, stance, feet=feet, margin=margin))
    figure = gait_figure(legs, parts, title="t")
    assert {f"{k}.00 s: {20 + 10 * k} mm" for k in range(4)} <= set(texts(figure))
    bars = [bar for bar in figure.axes[-1].patches if isinstance(bar, Rectangle)]
    assert sum(bar.get_width() for bar in bars) == pytest.approx(12.0)  # three of four stand
    assert outside(figure) == []


def test_same_figure_same_bytes_and_no_trace_of_the_machine(tmp_path: Path) -> None:
    before = matplotlib.rcParams.copy()
    for folder in ("one", "two"):
        save_figure(demand(), tmp_path / folder, "f")
    first = (tmp_path / "one" / "f.svg").read_bytes()
    assert first == (tmp_path / "two" / "f.svg").read_bytes()
    assert str(tmp_path).encode() not in first
    assert matplotlib.rcParams.copy() == before
    assert "matplotlib.pyplot" not in sys.modules


def test_an_error_in_a_figure_is_that_error(tmp_path: Path) -> None:
    def fail() -> None:
        raise LegwattError("nothing to draw")

    with pytest.raises(LegwattError, match="nothing to draw"):
        save_figures({"demand": demand, "bad": fail}, tmp_path)  # type: ignore[dict-item]
