"""What is drawn: shared draws, places in the friction band, value of knowing."""

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats.qmc import LatinHypercube

from pipeline.choice.evaluate import Held
from pipeline.choice.options import ChooseOptions
from pipeline.choice.robots import Search
from pipeline.choice.shelf import NO_MARGINS, Margins
from pipeline.choice.unknowns import monte_carlo
from tests.pipeline.choice.test_robots import STAND, search_of

DESIGNS = [("maxon_607930", "hd_csg_20_160", ""), ("maxon_614949", "hd_csg_25_100", "")]


@cache
def searched() -> Search:
    return search_of([name for design in DESIGNS for name in design if name], modes=[STAND])


def drawn_from(standing: str = "drawn") -> Search:
    search = searched()
    problem = replace(search.problem, wanted=ChooseOptions(standing=standing))
    return Search(problem, search.pairs, search.demand)


def test_power_in_a_draw_is_that_of_the_robot_with_the_drawn_values():
    search = drawn_from()
    robots = [(DESIGNS[0],) * 3, (DESIGNS[1],) * 3]
    found = monte_carlo(search, robots, 32)
    names = [(part, entry) for part, entry, _ in found.unknowns]
    low, high = (np.array([getattr(n, end) for *_, n in found.unknowns]) for end in ("low", "high"))
    inside = (found.values - low) / (high - low)
    assert np.allclose(inside, LatinHypercube(len(names), rng=0).random(32), atol=1e-12)
    factors = {entry: (n.low, n.high) for _, entry, n in found.unknowns if "_factor" in entry}
    assert sorted(factors.values()) == [(0.55, 1.55), (0.90, 1.05), (0.9, 1.2), (0.93, 1.07)]
    for s in (5, 17):
        sheet = dict(zip(names, found.values[s].tolist(), strict=True))
        held = [
            Held(
                np.array([[sheet[j, "friction_band_place"] for j in joints]] * 2),
                np.full(2, sheet["robot", "joint_torque_factor"]),
            )
            for joints in search.problem.groups.values()
        ]
        columns = zip(*robots, strict=True)
        parts = [search.shelf.designs(column, sheet, NO_MARGINS) for column in columns]
        built = search.built_of(parts, held)
        assert np.allclose(found.power[s], built.power, rtol=1e-9)
        assert found.within[s].tolist() == (built.use <= 1.0).tolist()
    change = dict(zip(names, found.sensitivity.tolist(), strict=True))
    # What idles is no other loss of one efficiency.
    assert change["moteus_x1", "idle_power"] == pytest.approx(18 * 8.13, rel=0.03)
    assert change[DESIGNS[1][0], "resistance_factor"] == 0.0  # not in the answer
    parts_of_it = found.variance_share * (found.sensitivity**2).sum() / 12  # uniform and linear
    assert found.power[:, 0].var() == pytest.approx(parts_of_it.sum(), rel=0.1)
    share = dict(zip(names, found.variance_share.tolist(), strict=True))
    assert share["moteus_x1", "idle_power"] == pytest.approx(1.0, abs=0.05)
    assert 0.0 < share["robot", "joint_torque_factor"] < 0.01
    first = float((found.power[:, 0] < found.power[:, 1]).mean())
    assert found.chance_least(robots[::-1]) == {robots[0]: first, robots[1]: 1.0 - first}
    safe = copy(search.shelf)
    safe.margins = Margins(9.0, 9.0)  # they are there for what is drawn
    bound = replace(search.problem, shelf=safe)
    used_up = monte_carlo(Search(bound, search.pairs, search.demand), robots, 32)
    assert (used_up.within == found.within).all()
    assert found.within.any()


def test_a_stated_place_in_the_friction_band_is_not_drawn():
    """Least takes less than middle, and that less than most; none of them is an unknown."""
    robots = [(DESIGNS[0],) * 3]
    power = []
    for place, drawn in (("least", 0), ("middle", 0), ("most", 0), ("drawn", 18)):
        search = drawn_from(place)
        found = monte_carlo(search, robots, 16)
        assert sum(entry == "friction_band_place" for _, entry, _ in found.unknowns) == drawn
        power.append(float(search.evaluated(robots).power[0]))
    assert power[0] < power[1] == power[3] < power[2]
