"""The plain evaluation against full chains, supplies and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pipeline as lw
from actuators.loading.data_sheet import KINDS, read_entry
from actuators.loading.parts import load_parts
from pipeline.choice.evaluate import Demand, Held, evaluate
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.mission import Mode
from pipeline.choice.shelf import PartCatalog, combinations
from pipeline.choice.tables import gear_life
from tests.pipeline.choice.brute import chain_of, in_full

LEAST = Held(place=0.0)
WALK = Mode("walk", 7.2, False, None, {}, "motor", True, "walking")
LOADED = replace(WALK, name="loaded", hours=2.4, changes={"gait.payload_mass": "2 kg"})
STAND = Mode("stand", 9.6, True, None, {}, "motor", True, "standing")
WAIT = replace(STAND, name="wait", hours=4.8, hold="brake", drivers=False)
DAY = (WALK, LOADED, STAND, WAIT)
PARTS = (
    *("maxon_148867", "maxon_634043", "maxon_607930", "cubemars_ak10_9_v3", "maxon_353297"),
    *("hd_csg_17_80", "hd_csg_25_100", "maxon_gp_52_c_66", "maxon_gp_42_hd_74"),
    *("hpc_m1_40", "hpc_m1_120"),
)
BRAKE = "mitsubishi_hc_mf_053b_13b"


@pytest.fixture(scope="module")
def loads() -> tuple[Load, ...]:
    return loads_of(lw.load("urdf/hexapod.toml"), DAY)


@pytest.fixture(scope="module")
def shelf() -> PartCatalog:
    """Few parts of every kind, so that brute force stays short."""
    parts = load_parts()
    idle = read_entry("idle_power", "0.672 W", KINDS["driver"])
    return PartCatalog({name: parts[name] for name in (*PARTS, BRAKE)}, voltage=44.0, idle=idle)


def tracks_of(loads: tuple[Load, ...], joints: list[str]):
    return Demand.of({"own": joints}, np.zeros(1), loads, (), 0.1).groups["own"]


@pytest.mark.parametrize("joint", ["2", "3"])
@pytest.mark.parametrize("fraction", [0.0, 0.4])
def test_power_and_limits_are_those_of_chains(
    loads: tuple[Load, ...], shelf: PartCatalog, joint: str, fraction: float
) -> None:
    """Every pair, with a brake and without: gears that are driven back, that lock, and none."""
    joints = [name for name in loads[0].series.joints if name.endswith(joint)]
    pairs = combinations(shelf)
    designs = shelf.designs([*pairs, *((motor, gear, BRAKE) for motor, gear, _ in pairs)])
    found = evaluate(tracks_of(loads, joints), designs, fraction, np.zeros(1), LEAST, detail=True)
    full = [in_full(designs, i, loads, joints, fraction) for i in range(len(designs))]
    holds = found.use["brake's torque"].max(axis=1) <= 1.0  # the others are beyond a limit
    power = np.array([power for power, _ in full])
    assert np.allclose(found.power[holds, :4], power[holds], rtol=1e-9)
    assert np.allclose(sum(found.causes.values()), found.power, rtol=1e-9)
    assert min(found.causes[name][:, :2].min() for name in ("winding", "friction")) > 0.0
    fits = np.max([use[:, :4].max(axis=1) for use in found.use.values()], axis=0) <= 1.0
    assert fits.tolist() == [ok for _, ok in full]
    assert 5 < fits.sum() < len(fits) - 5


def test_at_rest_torque_lies_in_the_band_of_friction(shelf: PartCatalog) -> None:
    """Least, most and middle by the chain's own interval; nothing for a gear that locks."""
    load = loads_of(lw.load("urdf/hexapod.toml"), [STAND])
    joints = list(load[0].series.joints)
    gears = ("maxon_gp_52_c_66", "hpc_m1_40")
    designs = shelf.designs([("maxon_148867", gear, "") for gear in gears])
    chain = chain_of(designs, 0, closed=False)
    torque = load[0].series.torque[0]
    band = chain.holding(torque)
    ends = np.sort(np.abs([band.low, band.high]), axis=0)
    least = np.where(band.low * band.high > 0.0, ends[0], 0.0)
    for place in (0.0, 0.5, 1.0):
        found = evaluate(
            tracks_of(load, joints), designs, 0.0, np.zeros(1), Held(place), detail=True
        )
        own = np.abs(found.torque[0][:, 0])
        loaded = torque != 0.0
        assert np.allclose(own[0][loaded], (least + place * (ends[1] - least))[loaded])
        assert not own[1].any()


def test_a_joint_holds_at_its_own_place_and_torques_scale(shelf: PartCatalog) -> None:
    load = loads_of(lw.load("urdf/hexapod.toml"), [STAND])
    joints = list(load[0].series.joints)
    designs = shelf.designs([("maxon_148867", "maxon_gp_52_c_66", "")] * 2)
    place = np.zeros((2, len(joints)))
    place[1, 7] = 1.0
    tracks = tracks_of(load, joints)
    found = evaluate(tracks, designs, 0.0, np.zeros(1), Held(place, np.ones(2)), detail=True)
    differs = np.flatnonzero(found.torque[0][1, 0] != found.torque[0][0, 0])
    assert differs.tolist() == [7]
    twice = Held(place, np.full(2, 2.0))
    found = evaluate(tracks, designs, 0.0, np.zeros(1), twice, detail=True)
    heavier = [replace(load[0], series=load[0].series.with_torque(2.0 * load[0].series.torque))]
    same = evaluate(tracks_of(tuple(heavier), joints), designs, 0.0, np.zeros(1), Held(place))
    assert np.allclose(found.power, same.power)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_best_ratio_is_that_of_roos(loads: tuple[Load, ...], friction: float) -> None:
    """Least mean square torque at n^4 = k2 / (J^2 k1): Roos, Johansson, Wikander 2006.

    With T = n J a + tau / n the mean square is n^2 J^2 k1 + k2 / n^2 + 2 J mean(a tau); with an
    efficiency below 1 tau is that before the gear, tau (1 + c) driving, (1 - c) driven.
    """
    joints = [joint for joint in loads[0].series.joints if joint.endswith("1")][:1]
    (track,) = tracks_of(loads[:1], joints)
    inertia, ratios = 5e-5, np.geomspace(5.0, 5000.0, 4001)
    shelf = PartCatalog({"maxon_353297": load_parts()["maxon_353297"]}, voltage=48.0)
    plain = shelf.designs([("maxon_353297", "", "")] * len(ratios))
    nothing = np.zeros(len(ratios))
    same = {name: nothing for name in ("coulomb", "viscous", "switching", "idle")}
    designs = replace(
        plain, ratio=ratios, inertia=nothing + inertia, load=nothing + friction, **same
    )
    copper = evaluate([track], designs, 1.0, np.zeros(1), detail=True).causes["winding"][:, 0]
    k1 = float(track.weight @ track.acceleration[:, 0] ** 2)
    tau, s = track.torque[:, 0], track.direction[:, 0]
    k2 = float(track.weight @ (tau + friction * np.abs(tau) * s) ** 2)
    assert ratios[copper.argmin()] == pytest.approx((k2 / (inertia**2 * k1)) ** 0.25, rel=2e-3)


def test_a_motor_at_standstill_bears_less_and_a_load_case_is_momentary(shelf: PartCatalog) -> None:
    """Limits that differ: 1 / sqrt(2) of the current without brushes; the momentary peak."""
    load = loads_of(lw.load("urdf/hexapod.toml"), [STAND])
    joints = list(load[0].series.joints)
    case = replace(STAND, hours=0.0)
    designs = shelf.designs([("maxon_607930", "hd_csg_25_100", "")])
    electronic, brushed = designs, replace(designs, standstill=np.ones(1))
    track, _ = tracks_of(load, joints)
    use = [evaluate([track], own, 0.0, np.zeros(1)).use for own in (electronic, brushed)]
    name = "motor's continuous current"
    assert use[0][name] == pytest.approx(use[1][name] * np.sqrt(2.0))
    both = [track, replace(track, mode=case, share=0.0)]
    found = evaluate(both, designs, 0.0, np.zeros(1), LEAST).use
    torque = found["gear's peak torque"][0]
    assert torque[0] / torque[1] == pytest.approx((designs.gear_momentary / designs.gear_peak)[0])
    # Least holds in the mode, but it has to be able to lift from there.
    current = found["motor's peak current"][0]
    most = evaluate([track], designs, 0.0, np.zeros(1), Held(1.0)).use
    assert current[1] == pytest.approx(most["motor's peak current"][0, 0])
    assert current[0] < current[1]


def test_gear_life_is_that_of_the_catalogue(loads: tuple[Load, ...], shelf: PartCatalog) -> None:
    """At rated torque and speed all day the rated life; at twice the torque an eighth of it."""
    design = shelf.designs([("maxon_148867", "hd_csg_17_80", "")])
    (track,) = tracks_of(loads[:1], [loads[0].series.joints[0]])
    speed = np.full_like(track.velocity, design.life_speed[0] / design.ratio[0])
    rated = replace(track, velocity=speed, torque=np.full_like(speed, design.life_torque[0]))
    life = design.life_hours[0]
    assert np.isfinite(life)
    assert gear_life([rated], design) == pytest.approx(life)
    twice = replace(rated, torque=2.0 * rated.torque)
    assert gear_life([twice], design) == pytest.approx(life / 8.0)
