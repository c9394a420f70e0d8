"""The search against full chains, brute force, and a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pipeline as lw
from actuators.loading.data_sheet import KINDS, read_entry
from actuators.loading.parts import PARTS, load_parts
from pipeline.choice.asked import ChooseOptions, filtered
from pipeline.choice.choose import knee
from pipeline.choice.group import front, merged, search
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.missions.mission import read_mission
from pipeline.choice.parts.shelf import Margins, Shelf, combinations, listed_pairs
from pipeline.choice.search import Demanded
from pipeline.choice.track import Account
from tests.pipeline.choice.brute import in_full

ACCOUNT = Account()
MISSION = """mode,share,gait,hold,drivers,payload
walk,0.3,,,,
loaded,0.1,,,,2 kg
stand,0.4,stand,motor,on,
wait,0.2,stand,brake,off,
"""


@pytest.fixture(scope="module")
def loads(tmp_path_factory: pytest.TempPathFactory) -> tuple[Load, ...]:
    path = tmp_path_factory.mktemp("mission") / "day.csv"
    path.write_text(MISSION)
    return loads_of(lw.load("urdf/hexapod.toml"), read_mission(path))


@pytest.fixture(scope="module")
def shelf() -> Shelf:
    """Few parts of every kind, so that brute force stays short."""
    parts = load_parts()
    names = [
        *("maxon_148867", "maxon_634043", "maxon_607930", "cubemars_ak10_9_v3", "maxon_353297"),
        *("hd_csg_17_80", "hd_csg_25_100", "maxon_gp_62_a_100", "maxon_gp_42_hd_74"),
        *("hpc_m1_40", "hpc_m1_120", "mitsubishi_hc_mf_053b_13b"),
    ]
    idle = read_entry("idle_power", "0.672 W", KINDS["driver"])
    return Shelf.of({name: parts[name] for name in names}, idle=idle)


def test_ten_best_and_front_are_those_of_brute_force(
    loads: tuple[Load, ...], shelf: Shelf, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though only two designs are looked at before bounds decide."""
    monkeypatch.setattr("pipeline.choice.group._FIRST", 2)
    joints = [joint for joint in loads[0].series.joints if joint.endswith("3")]
    demanded = Demanded.of("knee", joints, loads)
    designs = shelf.designs(combinations(shelf))
    found = search(demanded, designs, ACCOUNT)
    full = [in_full(designs, i, demanded) for i in range(len(designs))]
    fits = np.array([ok for _, ok in full])
    assert set(np.flatnonzero(fits)) == set(found.within)
    assert len(found.within) >= 10
    power = np.array([p if ok else np.inf for p, ok in full])
    best = found.looked[found.finalists[:10]]
    assert list(best) == list(np.argsort(power, kind="stable")[:10])
    assert np.allclose(found.power, power[found.looked], rtol=1e-9)
    monkeypatch.setattr("pipeline.choice.group.FINALISTS", 1)
    found = search(demanded, designs, ACCOUNT)
    own = front(power[fits], designs.mass[fits])
    assert np.allclose(found.power[found.front], power[fits][own], rtol=1e-9)


def test_bound_is_below_and_net_where_all_is_used_again(
    loads: tuple[Load, ...], shelf: Shelf
) -> None:
    joints = [joint for joint in loads[0].series.joints if joint.endswith("3")]
    demanded = Demanded.of("knee", joints, loads)
    designs = shelf.designs(combinations(shelf))
    net = demanded.net(designs)
    assert np.all(net <= demanded.power(designs, Account(policy="bus")) + 1e-9)
    assert np.all(net <= demanded.power(designs, ACCOUNT) + 1e-9)
    still = replace(designs, switching=np.zeros(len(designs)))
    net = demanded.net(still)
    assert np.allclose(net, demanded.power(still, Account(policy="bus")), rtol=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_best_ratio_is_that_of_roos(loads: tuple[Load, ...], friction: float) -> None:
    """Least mean square torque at n^4 = k2 / (J^2 k1): Roos, Johansson, Wikander 2006.

    With an efficiency below 1 tau is that before the gear, tau (1 + c) driving, (1 - c) driven.

    With T = n J a + tau / n the mean square is n^2 J^2 k1 + k2 / n^2 + 2 J mean(a tau).
    """
    joints = [joint for joint in loads[0].series.joints if joint.endswith("1")]
    demanded = Demanded.of("hip", joints[:1], loads[:1])
    track = demanded.tracks[0]
    inertia, ratios = 5e-5, np.geomspace(5.0, 5000.0, 4001)
    one = Shelf.of({"maxon_353297": load_parts()["maxon_353297"]})
    plain = one.designs([("maxon_353297", "", "")] * len(ratios))
    zero = np.zeros(len(ratios))
    designs = replace(
        plain,
        **{"ratio": ratios, "inertia": zero + inertia},
        **{"load": zero + friction, "coulomb": zero, "viscous": zero},
    )
    net = demanded.net(replace(designs, switching=zero))
    k1 = float(track.weight @ track.series.acceleration[:, 0] ** 2)
    tau, s = track.series.torque[:, 0], track.series.direction[:, 0]
    k2 = float(track.weight @ (tau + friction * np.abs(tau) * s) ** 2)
    assert ratios[net.argmin()] == pytest.approx((k2 / (inertia**2 * k1)) ** 0.25, rel=2e-3)


def test_fronts_add() -> None:
    rng = np.random.default_rng(1)
    groups = [(rng.random(30), rng.random(30)) for _ in range(3)]
    fronts = []
    for power, mass in groups:
        own = front(power, mass)
        fronts.append((power[own], mass[own]))
    power, mass, taken = merged(fronts)
    every_p = sum(np.meshgrid(*(p for p, _ in groups), indexing="ij")).ravel()
    every_m = sum(np.meshgrid(*(m for _, m in groups), indexing="ij")).ravel()
    own = front(every_p, every_m)
    assert np.allclose(power, every_p[own])
    assert np.allclose(mass, every_m[own])
    assert np.allclose(power, sum(p[taken[:, k]] for k, (p, _) in enumerate(fronts)))


def test_a_part_that_says_less_is_filled_from_its_class() -> None:
    """A strain wave gear stripped of what it may leave out has the ranges of its class."""
    parts = load_parts()
    whole = parts["maxon_gp_42_c_126"]
    kept = {name: whole.printed[name] for name in ("gear_ratio", "gear_continuous_torque")}
    bare = replace(whole, name="bare", printed=kept)
    shelf = Shelf.of({"bare": bare, "worm": replace(parts["hpc_m1_120"], name="worm")})
    own = shelf.numbers["bare"]
    for entry in ("mass", "gear_inertia", "gear_max_speed", "gear_starting_torque"):
        assert 0.0 < own[entry].low < own[entry].high, entry
        assert own[entry].low / 3 < whole.printed[entry].value < own[entry].high * 3, entry
    assert own["gear_efficiency"].low < own["gear_efficiency"].high < 1.0
    # 2 to 50 % of what the worm loses at 40 N*m: 40 / 120 (1 / 0.25 - 1) = 1 N*m at its input.
    start = shelf.numbers["worm"]["gear_starting_torque"]
    assert (start.low, start.high) == pytest.approx((0.02, 0.5))


def test_options_leave_what_they_do_not_name() -> None:
    """A filter of motors leaves all gears of the kinds asked for, and the brakes."""
    only, kinds = ("maxon_148867", "wittenstein"), ("strain_wave", "planetary")
    wanted = ChooseOptions(only=only, without=("hd_",), kind=kinds)
    left = filtered(load_parts(), wanted)
    assert [name for name, part in left.items() if part.kind == "motor"] == ["maxon_148867"]
    assert {part.kind for part in left.values()} == {"motor", "planetary", "brake"}
    assert any(name.startswith("mitsubishi") for name in left)


def test_a_motor_goes_on_gears_that_its_maker_lists_and_that_the_builder_mounts() -> None:
    parts = load_parts()
    names = ("maxon_148867", "maxon_607930", "maxon_gp_52_c_66", "hd_csg_17_80", "hpc_m1_40")
    shelf = Shelf.of({name: parts[name] for name in names})
    pairs = listed_pairs(PARTS)
    listed = {(motor, gear) for motor, gear, _ in combinations(shelf, pairs=pairs)}
    assert {gear for motor, gear in listed if motor == "maxon_607930"} == {"", "hd_csg_17_80"}
    assert ("maxon_148867", "maxon_gp_52_c_66") in listed
    assert not any(gear == "hpc_m1_40" for _, gear in listed)
    assert len({row[:2] for row in combinations(shelf)}) == 2 * 4
    assert {part for pair in pairs for part in pair} <= parts.keys()  # no name is misspelt


def test_margins_divide_limits_and_nothing_else() -> None:
    parts = load_parts()
    design = [("maxon_148867", "maxon_gp_52_c_66", "")]
    own = {name: parts[name] for name in design[0] if name}
    plain, safe = (
        Shelf.of(own, voltage=48.0, margins=margins).designs(design)
        for margins in (Margins(), Margins(1.5, 1.15))
    )
    torque = {"gear_peak", "gear_continuous", "continuous_current"}
    speed = {"gear_speed", "max_speed", "voltage"}
    for name, value in vars(plain).items():
        if name != "parts":
            share = 1.5 if name in torque else 1.15 if name in speed else 1.0
            assert getattr(safe, name) * share == pytest.approx(value), name


def test_the_knee_is_the_corner_of_a_front() -> None:
    assert knee(np.array([10.0, 10.2, 12.0, 20.0]), np.array([20.0, 12.0, 11.7, 11.0])) == 1
    assert knee(np.array([10.0, 20.0]), np.array([5.0, 4.0])) == 0


def test_numbers_of_parts_add_ratios_multiply_and_the_lower_limit_holds(shelf: Shelf) -> None:
    motor, gear = ("maxon_634043", "", ""), ("", "hd_csg_17_80", "")
    both = shelf.designs([(*motor[:1], *gear[1:])])
    one, two = shelf.designs([motor]), shelf.designs([gear])
    assert both.mass == one.mass + two.mass
    assert (both.ratio, both.gear_peak) == (two.ratio, two.gear_peak)
    assert np.isinf(one.gear_peak)
    assert np.isfinite(both.gear_peak)
    # A gear that locks needs no brake.
    braked = {gear for _, gear, brake in combinations(shelf) if brake}
    assert braked == {"", "hd_csg_17_80", "hd_csg_25_100", "maxon_gp_62_a_100", "maxon_gp_42_hd_74"}
