"""What is drawn: shared draws, places in the friction band, value of knowing."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from actuators.loading.data_sheet import Number
from pipeline.choice.evaluate import Held
from pipeline.choice.options import ChooseOptions
from pipeline.choice.robots import Search, evaluate_robots
from pipeline.choice.shelf import Margins
from pipeline.choice.unknowns import MonteCarlo, monte_carlo
from tests.pipeline.choice.test_robots import STAND, search_of

DESIGNS = [("maxon_607930", "hd_csg_20_160", ""), ("maxon_614949", "hd_csg_25_100", "")]


@cache
def searched() -> Search:
    return search_of([name for design in DESIGNS for name in design if name], modes=[STAND])


def drawn_from(standing: str = "drawn") -> Search:
    search = searched()
    problem = replace(search.problem, wanted=ChooseOptions(standing=standing))
    return Search(problem, search.pairs, search.demand)


def test_power_in_a_draw_is_that_of_the_robot_with_the_drawn_values() -> None:
    search = drawn_from()
    robots = [(DESIGNS[0],) * 3, (DESIGNS[1],) * 3]
    found = monte_carlo(search, robots, 32)
    names = [(part, entry) for part, entry, _ in found.unknowns]
    for s in (5, 17):
        sheet = dict(zip(names, found.values[s].tolist(), strict=True))
        held = [
            Held(
                np.array([[sheet[j, "friction_band_place"] for j in joints]] * 2),
                np.full(2, sheet["robot", "joint_torque_factor"]),
            )
            for joints in search.problem.groups.values()
        ]
        parts = [search.shelf.designs(column, sheet) for column in zip(*robots, strict=True)]
        power = evaluate_robots(parts, search.demand, search.problem, held).power
        assert np.allclose(found.power[s], power, rtol=1e-9)
    change = dict(zip(names, found.sensitivity.tolist(), strict=True))
    # What idles is no other loss of one efficiency.
    assert change["moteus_x1", "idle_power"] == pytest.approx(18 * 8.13, rel=0.03)
    assert change[DESIGNS[1][0], "resistance_factor"] == 0.0  # not in the answer
    assert found.groups.sum(axis=1) == pytest.approx(found.power[:, 0])
    safe = copy(search.shelf)
    safe.margins = Margins(9.0, 9.0)  # they are there for what is drawn
    bound = replace(search.problem, shelf=safe)
    used_up = monte_carlo(Search(bound, search.pairs, search.demand), robots, 32)
    assert (used_up.within == found.within).all()
    assert found.within.any()


def test_a_stated_place_in_the_friction_band_is_not_drawn() -> None:
    """Least takes less than middle, and that less than most; none of them is an unknown."""
    robots = [(DESIGNS[0],) * 3]
    power = []
    for place, drawn in (("least", 0), ("middle", 0), ("most", 0), ("drawn", 18)):
        search = drawn_from(place)
        found = monte_carlo(search, robots, 16)
        assert sum(entry == "friction_band_place" for _, entry, _ in found.unknowns) == drawn
        power.append(float(search.evaluated(robots).power[0]))
    assert power[0] < power[1] == power[3] < power[2]


def test_value_is_what_knowing_an_unknown_removes_of_the_loss() -> None:
    """Two robots: u decides which is better, v does nothing, w moves both alike."""
    rng = np.random.default_rng(3)
    values = rng.random((512, 3))
    u, _, w = values.T
    power = np.stack([10.0 + w, 9.5 + u + w], axis=1)
    number = Number(0.5, 0.0, 1.0, "W", "0 to 1 W")
    of = tuple(("part", name, number) for name in "uvw")
    within = np.ones(power.shape, dtype=bool)
    own = MonteCarlo([], 2, power, power[..., None], power[:, :1], within, of, values, np.zeros(3))
    # Perfect knowledge of u: mean of max(u - 0.5, 0) or of max(0.5 - u, 0), 1/8.
    assert own.opportunity_loss == pytest.approx(0.125, abs=0.03)
    assert own.value_of_information() == pytest.approx([own.opportunity_loss, 0.0, 0.0], abs=0.015)
    other = np.column_stack([power, np.zeros(512)])  # never the answer, however little it takes
    most = (other[..., None], other[:, :1], np.ones(other.shape, dtype=bool), of, values)
    assert MonteCarlo([], 2, other, *most, np.zeros(3)).opportunity_loss == own.opportunity_loss
    few = rng.random((64, 12))  # of which the first decides: chance must not make the others worth
    two = np.stack([np.full(64, 10.0), 9.5 + few[:, 0]], axis=1)
    every = (two[..., None], two, np.ones(two.shape, dtype=bool), of * 4, few, np.zeros(12))
    worth = MonteCarlo([], 2, two, *every).value_of_information()
    assert worth[0] > 0.06
    assert worth[1:].mean() < 0.005
