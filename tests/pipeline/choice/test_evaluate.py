"""The plain evaluation against full chains, supplies and closed forms."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

import pipeline as lw
from actuators.chain import Chain
from actuators.elements.element import Element, Friction, Inertia, Ratio
from actuators.elements.hypoid import Hypoid
from actuators.energy import Driver, duration, limit_rows, supply_of
from actuators.loading.build import WINDING
from actuators.loading.data_sheet import KINDS, read_entry
from actuators.loading.parts import load_parts
from actuators.shaft import DCMotor
from pipeline.choice.evaluate import Demand, Held, _Pass, evaluate
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.mission import Mode
from pipeline.choice.shelf import Designs, PartCatalog, combinations
from pipeline.choice.tables import as_held, gear_life

LEAST = Held(place=0.0)
#: Limits of motors as chains name them.
NAMES = {"motor's speed": "speed", "motor's peak current": "current"}
NAMES["motor's continuous current"] = "rms_current"
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
    return tuple(loads_of(lw.load("urdf/hexapod.toml"), DAY)[0])


@pytest.fixture(scope="module")
def shelf() -> PartCatalog:
    """Few parts of every kind, so that brute force stays short."""
    parts = load_parts()
    idle = read_entry("idle_power", "0.672 W", KINDS["driver"])
    return PartCatalog({name: parts[name] for name in (*PARTS, BRAKE)}, voltage=44.0, idle=idle)


def tracks_of(loads: tuple[Load, ...], joints: list[str]):
    return Demand.of({"own": joints}, np.zeros(1), loads, nudge=0.1).groups["own"]


def chain_of(d: Designs, i: int, *, closed: bool) -> Chain:
    """One design, element by element; its brake is closed or open."""
    ratio, load = float(d.ratio[i]), float(d.load[i])
    gear: Element = Ratio("transmission", ratio)
    if load >= 1.0:
        gear = Hypoid("transmission", ratio, pinion_angle=np.pi / 4, friction=load)
        load = 0.0
    friction = Friction("friction", coulomb=d.coulomb[i], load=load, viscous=d.viscous[i])
    elements = [gear, friction]
    if closed:  # it holds like dry friction and is gone in motion
        elements.append(Friction("brake", excess=d.brake_torque[i], stribeck_speed=1e-12))
    elements.append(Inertia("rotor", d.inertia[i]))
    constants = (d.torque_constant, d.resistance, d.max_speed, d.voltage)
    limits = (d.continuous_current, d.peak_current)
    motor = DCMotor(WINDING, *(number[i] for number in (*constants, *limits)))
    return Chain("design", tuple(elements), motor, MappingProxyType({"m": "rotor"}))


def in_full(d, i, loads, joints, fraction=0.0):
    """One design through its chain: mean power of every mode, greatest share of each limit."""
    powers, use = [], dict[str, float]()

    def asked(limit: str, share: float) -> None:
        use[limit] = max(float(share), use.get(limit, 0.0))

    driver = Driver("driver", d.driver_resistance[i], d.idle[i], d.switching[i])
    for load in loads:
        mode, series = load.mode, load.series.of(joints)
        closed = mode.stands and mode.hold == "brake"
        result = chain_of(d, i, closed=closed).inverse(series)
        lost = driver.loss(result.current, d.bus[i]) - d.idle[i]
        lost += 0.0 if closed else d.brake_power[i]
        flow = supply_of(result.electrical_power + lost, series.time, joints, fraction)
        locks = d.load[i] >= 1.0 or (closed and d.brake_torque[i] > 0.0)
        on = (result.current != 0).any(axis=0).sum() if locks and not mode.drivers else len(joints)
        powers.append(flow.supplied_energy.sum() / duration(load.series.time) + d.idle[i] * on)
        still = d.standstill[i] if mode.stands else 1.0
        for row in limit_rows(result):
            limit = row.limit * (still if row.quantity == "rms_current" else 1.0)
            asked(row.quantity, row.peak / limit)
        volts = result.current * d.resistance[i] + result.motor.velocity * d.torque_constant[i]
        drop = d.driver_resistance[i] * np.abs(result.current)
        asked("voltage", (np.abs(volts) + drop).max() / d.voltage[i])
        torque = series.torque
        rms = np.sqrt(np.trapezoid(torque**2, series.time, axis=0) / duration(load.series.time))
        asked("gear's peak torque", np.abs(torque).max() / d.gear_peak[i])
        asked("gear's continuous torque", rms.max() / d.gear_continuous[i])
        asked("gear's speed", np.abs(result.motor.velocity).max() / d.gear_speed[i])
        if closed and d.brake_torque[i] > 0.0:
            asked("brake's torque", np.abs(torque).max() / d.ratio[i] / d.brake_torque[i])
    return powers, use


@pytest.mark.parametrize(("joint", "fraction"), [("2", 0.0), ("3", 0.4)])
def test_power_and_limits_are_those_of_chains(loads, shelf, joint, fraction):
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
    for name in found.use.keys() - {"driver's supply", "gear's mean speed"}:
        asked = np.array([use.get(NAMES.get(name, name), 0.0) for _, use in full])
        assert np.allclose(found.use[name][holds, :4].max(axis=1), asked[holds], rtol=1e-9), name
    assert 5 < (found.most <= 1.0).sum() < len(designs) - 5


def test_at_rest_torque_lies_in_the_band_of_friction(shelf):
    """Least, most and middle by the chain's own interval; nothing for a gear that locks."""
    (load,) = loads_of(lw.load("urdf/hexapod.toml"), [STAND])
    joints = list(load[0].series.joints)
    gears = ("maxon_gp_52_c_66", "hpc_m1_40")
    designs = shelf.designs([("maxon_148867", gear, "") for gear in gears])
    chain = chain_of(designs, 0, closed=False)
    torque = load[0].series.torque[0]
    band = chain.holding(torque)
    ends = np.sort(np.abs([band.low, band.high]), axis=0)
    least = np.where(band.low * band.high > 0.0, ends[0], 0.0)
    places = np.tile(np.linspace(0.0, 1.0, len(joints)), (2, 1))  # each joint at its own
    for place in (0.0, 0.5, 1.0, places):
        held, tracks = Held(place, np.full(2, 2.0)), tracks_of(load, joints)
        lighter = [replace(t, torque=0.5 * t.torque) for t in tracks]  # times the factor of two
        found = evaluate(lighter, designs, 0.0, np.zeros(1), held, detail=True)
        k = designs.torque_constant / np.sqrt(designs.resistance)
        loss = found.causes["winding"][:, 0]
        alone = _Pass(tracks[0], designs, tracks[0].torque[None], place)
        assert np.allclose(loss, (alone.torque[:, 0] ** 2).sum(axis=1) / k**2)
        own, at = np.abs(alone.torque[:, 0]), place[0] if np.ndim(place) else place
        loaded = torque != 0.0
        assert np.allclose(own[0][loaded], (least + at * (ends[1] - least))[loaded])
        assert not own[1].any()


def test_a_load_case_is_momentary(shelf):
    (load,) = loads_of(lw.load("urdf/hexapod.toml"), [STAND])
    designs = shelf.designs([("maxon_607930", "hd_csg_25_100", "")])
    track, _ = tracks_of(load, list(load[0].series.joints))
    both = [track, replace(track, mode=replace(STAND, hours=0.0), share=0.0)]
    found = evaluate(both, designs, 0.0, np.zeros(1), LEAST).use
    torque = found["gear's peak torque"][0]
    assert torque[0] / torque[1] == pytest.approx((designs.gear_momentary / designs.gear_peak)[0])
    # Least holds in the mode, but it has to be able to lift from there.
    current = found["motor's peak current"][0]
    most = evaluate([track], designs, 0.0, np.zeros(1), Held(1.0)).use
    assert current[1] == pytest.approx(most["motor's peak current"][0, 0])
    assert current[0] < current[1]


def test_gear_life_is_that_of_the_catalogue(loads, shelf):
    """At rated torque and speed all day the rated life; at twice the torque an eighth of it."""
    sheet = shelf.values("hd_csg_17_80")
    (track,) = tracks_of(loads[:1], [loads[0].series.joints[0]])
    speed = np.full_like(track.velocity, sheet["gear_life_speed"] / sheet["gear_ratio"])
    rated = replace(track, velocity=speed, torque=np.full_like(speed, sheet["gear_life_torque"]))
    assert gear_life([rated], sheet) == pytest.approx(10_000)
    designs = shelf.designs([("maxon_634043", "hd_csg_17_80", "")])
    use = evaluate([rated], designs, 0.0, np.zeros(1)).use
    for name, rpm in (("gear's mean", 3500), ("gear's", 7300), ("motor's", 5000)):
        assert use[f"{name} speed"] == pytest.approx(2000 / rpm), name
    twice = replace(rated, torque=2.0 * rated.torque)
    assert gear_life([twice], sheet) == pytest.approx(10_000 / 8.0)


def test_todays_actuators_are_held_at_a_place_in_the_band_and_lift_in_load_cases():
    machine = lw.load("urdf/hexapod.toml")
    ((load,),) = loads_of(machine, [STAND])
    case = replace(load, mode=replace(load.mode, hours=0.0))
    chain, count = machine.chains()["reversible"], len(machine.robot.joints)
    held = chain.holding(load.series.torque)
    ends = np.maximum(np.abs(held.low), np.abs(held.high))
    (least, locked), (middle, _), (most, _), (lifts, _) = (
        as_held(chain, own, place)
        for own, place in ((load, 0.0), (load, 0.5), (load, 1.0), (case, 0.0))
    )
    assert locked == 0
    assert np.allclose(least.current, held.current)
    assert np.allclose(middle.current, 0.5 * (least.current + most.current))
    assert np.allclose(most.current, lifts.current)
    torque = np.abs(most.current) * most.motors[0].torque_constant
    assert np.allclose(torque, ends * (load.series.torque != 0.0))
    assert np.allclose(most.electrical_power, most.voltage * most.current)
    irreversible, locks = as_held(machine.chains()["irreversible"], case, 0.5)
    assert locks == count
    assert not irreversible.current.any()
