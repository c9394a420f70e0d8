"""Mass fed back: the demand of any masses, and a robot that nothing in one group improves."""

from __future__ import annotations

import numpy as np
import pytest

import pipeline as lw
from actuators.elements.two_body import REFERENCE_K
from actuators.errors import LegwattError
from actuators.loading.parts import PACK, load_parts
from pipeline.choice.asked import Asked
from pipeline.choice.group import groups_of
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import read_mission
from pipeline.choice.parts.shelf import Shelf, combinations
from pipeline.choice.search import Demanded
from pipeline.choice.settle import Robots
from pipeline.choice.track import Account

PARTS = (
    *("maxon_148867", "maxon_402687", "faulhaber_4221g024bxth", "maxon_496655"),
    *("hpc_m1_120", "maxon_gp_32_hp_132", "maxon_gp_22_hp_84", "maxon_gp_42_c_126"),
)


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> Asked:
    path = tmp_path_factory.mktemp("mission") / "day.csv"
    path.write_text("mode,share,gait\nwalk,0.4,\nstand,0.6,stand\n")
    machine = lw.load("urdf/solo12.toml")
    known = load_parts()
    shelf = Shelf.of({name: known[name] for name in PARTS})
    groups = groups_of(machine.robot.spec)
    return Asked(machine, read_mission(path), groups, shelf, Account(), 0.0, known[PACK])


@pytest.fixture(scope="module")
def robots(asked: Asked) -> Robots:
    return Robots.about(asked, dict.fromkeys(asked.groups, 0.3))


def test_demand_of_any_masses_is_that_computed_anew(asked: Asked, robots: Robots) -> None:
    mass = {g: 0.1 + 0.2 * k for k, g in enumerate(asked.groups)}
    added = {joint: mass[g] for g, joints in asked.groups.items() for joint in joints}
    anew = loads_of(asked.machine, asked.modes, added, along=robots.loads)
    for g, demanded in asked.demanded(robots.at(mass)).items():
        own = Demanded.of(g, asked.groups[g], anew)
        for one, other in zip(demanded.tracks, own.tracks, strict=True):
            scale = np.abs(other.series.torque).max()
            assert np.allclose(one.series.torque, other.series.torque, atol=1e-6 * scale)


def test_settled_robot_is_the_best_of_all_that_differ_in_one_group(
    asked: Asked, robots: Robots
) -> None:
    every = combinations(asked.shelf, brakes=False)
    pool = dict.fromkeys(asked.groups, [d for d in every if d[1]][:4])
    answer = robots.settled({g: every[0] for g in asked.groups}, pool)
    best = robots.cost(answer)
    for g, designs in pool.items():
        for design in designs:
            assert robots.cost({**answer, g: design}) >= (best[0], best[1] * (1 - 1e-5))
    assert robots.settled(answer, pool) == answer


def test_what_exceeds_a_limit_with_its_own_mass_is_one_line(asked: Asked, robots: Robots) -> None:
    weak = ("maxon_402687", "maxon_gp_22_hp_84", "")
    heavy = Robots.about(asked, dict.fromkeys(asked.groups, 10.0))
    with pytest.raises(
        LegwattError, match=r"own actuators' mass: group .* 10 kg a joint"
    ) as caught:
        heavy.check(dict.fromkeys(asked.groups, weak))
    assert "\n" not in str(caught.value)


def test_winding_temperature_is_that_of_the_closed_form_and_runs_away_beyond() -> None:
    """RE 40: in the end (R_wh + R_ha) c P, with c = 1 + 0.00393 dT: a closed form of one mode."""
    shelf = Shelf.of({"maxon_148867": load_parts()["maxon_148867"]})
    design = shelf.designs([("maxon_148867", "", "")])
    current = np.array([2.0, 3.0, 12.0])
    copper = design.resistance * current**2
    found = design.day([24.0], copper[:, None])
    cold = (1.93 + 4.65) * copper[:2]
    assert found.peak[:2] - REFERENCE_K == pytest.approx(cold / (1 - 0.00393 * cold), rel=1e-3)
    use = design.heat_use([24.0], copper[:, None])
    assert use[:2] == pytest.approx((found.peak[:2] - REFERENCE_K) / (155.0 - 25.0), rel=1e-9)
    assert np.isinf(use[2])
    # One minute of it in an hour is borne.
    spent = np.stack([copper[2:], 0.0 * copper[2:]], axis=1)
    assert np.isfinite(design.heat_use([1 / 60, 1.0], spent)).all()
