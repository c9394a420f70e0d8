"""Robots with their own mass: against demand computed anew, brute force, and more parts."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice, product
from types import SimpleNamespace

import numpy as np
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from actuators.loading.parts import PACK, PARTS, listed_pairs, load_parts
from actuators.parameters import quantity
from pipeline.choice import robots
from pipeline.choice.choose import _answers, _searched
from pipeline.choice.evaluate import ModeSeries
from pipeline.choice.loads import cases_of, loads_of, with_masses
from pipeline.choice.mission import PAYLOAD, Mode
from pipeline.choice.options import ChooseOptions, Problem, _shared, groups_of, problem_of
from pipeline.choice.robots import Search, demand_of, front, knee, merged
from pipeline.choice.shelf import Margins, PartCatalog, combinations
from pipeline.choice.standing import ALL, NONE, crossing, crossing_range, envelope
from pipeline.choice.unknowns import monte_carlo

WALK = Mode("walk", 6.0, False, None, {}, "motor", True, "walking")
STAND = Mode("stand", 10.0, True, None, {}, "motor", True, "standing")
WAIT = Mode("wait", 8.0, True, None, {}, "brake", False, "waiting")
DAY = (WALK, STAND, WAIT)
OPEN = ChooseOptions(unlisted=True)
SLOW = pytest.mark.slow
MOTORS = ("maxon_148867", "maxon_402687", "maxon_496655", "maxon_614949", "cubemars_ak80_9_v3")
GEARS = ("hd_csg_17_120", "hd_csg_20_160", "maxon_gp_42_c_126", "hpc_m1_120")
BRAKES = ("mitsubishi_ha_ff_053b_13b", "mitsubishi_hc_mf_23b_43b")
#: Eight motors, eight gears and three brakes, small ones for Solo12 among them.
WIDE = (
    *("maxon_402687", "maxon_496655", "maxon_539487", "maxon_614949", "maxon_634043"),
    *("cubemars_ak80_9_v3", "cubemars_ak60_39", "cubemars_ak80_64"),
    *("hd_csg_14_100", "hd_csg_17_120", "hd_csg_20_160", "hd_csg_25_160"),
    *("maxon_gp_32_c_111", "maxon_gp_42_c_126", "hpc_m1_40", "hpc_m1_120"),
    *(*BRAKES, "mitsubishi_ha_ff_23b_33b"),
)
ROBOTS = (
    *("urdf/hexapod.toml", "urdf/solo12.toml", "urdf/anymal_c.toml", "b1"),
    "urdf/tytan.urdf",  # its legs and stance are guessed
)


def shelf_of(names: Sequence[str]) -> PartCatalog:
    known = load_parts()
    return PartCatalog({n: known[n] for n in names}, voltage=46.8, margins=Margins(1.2, 1.1))


def search_of(names, robot="urdf/hexapod.toml", modes=DAY, pairs=None, step=1):
    """Of every `step`-th sample of a motion."""
    machine, shelf = lw.load(robot), shelf_of(names)
    groups = groups_of(machine.robot.spec)
    problem = Problem(machine, modes, groups, shelf, 0.3, load_parts()[PACK], OPEN)
    demand = demand_of(problem, dict.fromkeys(groups, 0.3))
    for tracks in demand.groups.values():
        tracks[:] = [track if track.mode.stands else thinned(track, step) for track in tracks]
    return Search(problem, combinations(shelf, pairs), demand)


def thinned(track: ModeSeries, step: int) -> ModeSeries:
    names = ("torque", "velocity", "acceleration", "direction")
    own = {name: getattr(track, name)[::step] for name in names}
    times = np.append(0.0, np.cumsum(track.step))[::step]
    return replace(track, **own, slope=track.slope[:, ::step], step=np.diff(times))


@pytest.fixture(scope="module")
def search() -> Search:
    out = search_of((*MOTORS, *GEARS, *BRAKES))
    out.run()
    return out


@pytest.fixture(scope="module")
def thin() -> Search:
    return search_of(WIDE, step=8)


def test_demand_of_any_masses_is_that_computed_anew(search):
    problem = search.problem
    mass = {g: 0.4 + 0.3 * k for k, g in enumerate(problem.groups)}
    more = np.array(list(mass.values())) - search.demand.mass
    anew = demand_of(problem, mass, slopes=False)
    for own, other in zip(search.demand.groups.values(), anew.groups.values(), strict=True):
        for one, two in zip(own, other, strict=True):
            torque = one.torque + np.tensordot(more, one.slope, axes=1)
            assert np.allclose(torque, two.torque, atol=1e-6 * np.abs(two.torque).max() + 1e-9)


def test_designs_that_exceed_a_limit_by_a_tenth_in_the_lightest_robot_are_searched(thin):
    pairs, every = thin.shelf.designs(thin.pairs), np.zeros(0)
    light = np.full(3, pairs.mass.min()) - thin.demand.mass
    for name, tracks in thin.demand.groups.items():
        use = robots.evaluate(tracks, pairs, 0.0, light, thin.held).most
        kept = {parts[:2] for parts in thin.designs[name].parts}
        assert kept == {pairs.parts[i][:2] for i in np.flatnonzero(use <= 1.1)}
        every = np.append(every, use)
    assert ((every > 0.9) & (every <= 1.1)).any()
    assert ((every > 1.1) & (every < 1.11)).any()


@pytest.mark.parametrize("robot", ["", *(pytest.param(r, marks=SLOW) for r in ROBOTS)])
def test_answers_are_those_of_brute_force(search, robot):
    """Every robot of the shelf, each with its own mass: the same front; 8 by 8 by 3 of a group."""
    if robot:
        search = search_of(WIDE, robot, step=8)
        search.run()
    brakes = ["", *(name for name, part in search.shelf.parts.items() if part.kind == "brake")]
    pairs = combinations(search.shelf)
    own = [(m, g, b) for m, g, _ in pairs for b in brakes if not (b and g[:3] == "hpc")]
    designs = search.shelf.designs(own)
    ends = [np.full(3, of(designs.mass)) - search.demand.mass for of in (min, max)]
    columns = []
    for name, tracks in search.demand.groups.items():
        least, most = (robots.evaluate(tracks, designs, 0.0, end, search.held) for end in ends)
        fits = least.most <= 1.0  # in the lightest robot; others are part of none
        assert fits.sum() >= 5, name
        if robot:  # none that takes more there than a lighter one in the heaviest, within limits
            heavy = np.where(most.most <= 1.0, most.power @ search.shares, np.inf)
            lighter = designs.mass <= designs.mass[:, None]
            fits &= ~(lighter & (heavy < (least.power @ search.shares)[:, None])).any(axis=1)
        columns.append([own[i] for i in np.flatnonzero(fits)])
    kept: list[robots.Robot] = []
    power, mass, count = np.zeros(0), np.zeros(0), 0
    every = product(*columns)
    while some := [*islice(every, 4000)]:
        found = search.evaluated(some)
        fits = np.flatnonzero(found.use <= 1.0)
        count += len(fits)
        kept += [some[i] for i in fits]
        power = np.append(power, found.power[fits])
        mass = np.append(mass, found.total("mass", search.counts)[fits])
        best = front(power, mass)  # what it beats is beaten
        kept, power, mass = [kept[i] for i in best], power[best], mass[best]
    assert count > 5
    best = search.front()
    known = [search.known[robot] for robot in best]
    assert [own.power for own in known] == pytest.approx(power.tolist(), rel=1e-9)
    assert [own.mass for own in known] == pytest.approx(mass.tolist(), rel=1e-9)
    assert {*best} == {*kept}


def test_no_design_in_one_group_improves_an_answer():
    """Every pair of the shelf that makers list, in place of each group's design of the front."""
    known = load_parts()
    motors = [n for n, p in known.items() if p.kind == "motor" and n[-1] in "0123456789"]
    gears = [n for n, p in known.items() if p.kind in ("planetary", "strain_wave")]
    wide = search_of([*motors[::2], *gears], pairs=listed_pairs(PARTS))
    wide.run()
    best = wide.front()
    ends = [wide.known[robot] for robot in (best[0], best[-1])]
    for robot in dict.fromkeys((best[0], best[len(best) // 2], best[-1])):
        for g, own in enumerate(wide.designs.values()):
            others = [(*robot[:g], design, *robot[g + 1 :]) for design in own.parts]
            found = wide.evaluated(others)
            fits, mass = found.use <= 1.0, found.total("mass", wide.counts)
            better = (found.power < wide.known[robot].power - 1e-9) & fits
            assert not (better & (mass <= wide.known[robot].mass)).any()
            assert found.power[fits].min() >= ends[0].power - 1e-9
            assert mass[fits].min() >= ends[1].mass - 1e-9


def test_no_answer_has_a_part_that_is_sold_inside_another_product_alone(search):
    """The envelope has them, to say whether locking would pay."""
    plain = Search(replace(search.problem, wanted=ChooseOptions()), search.pairs, search.demand)
    plain.run()
    front = plain.front()
    assert front
    assert not any(brake for robot in plain.within for *_, brake in robot)
    assert any(brake for robot in search.within for *_, brake in robot)
    none = {r for r in search.known if not any(brake for *_, brake in r)} & {*search.within}
    best = min(search.known[robot].power for robot in none)
    assert plain.known[front[0]].power <= best * (1 + 1e-9)
    assert ALL in envelope(plain).power


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=SLOW) for k in range(1, 9))])
def test_more_parts_make_no_end_of_the_front_worse(thin, seed):
    """Shelves that grow by parts in any order; where none is within limits, ends are infinite."""
    order = [MOTORS[seed % 5], *np.random.default_rng(seed).permutation(WIDE).tolist()]
    before = np.full(2, np.inf)
    for count in (5, 8, 12, len(order)):
        shelf = shelf_of(order[:count])
        own = Search(replace(thin.problem, shelf=shelf), combinations(shelf), thin.demand).run()
        within = [robot for robot in own.known.values() if robot.use <= 1.0]
        ends = np.array([min((robot[k] for robot in within), default=np.inf) for k in (0, 1)])
        assert (ends <= before * (1.0 + 1e-9)).all(), count
        before = ends
    assert np.isfinite(before).all()


def test_no_robot_found_names_group_limit_mode_and_by_how_much():
    heavy = search_of(("maxon_614949", "hd_csg_20_160"))
    for tracks in heavy.demand.groups.values():  # its own mass is too much for it
        tracks[:] = [replace(t, slope=3.0 * t.slope) for t in tracks]
    words = heavy.run().closest()
    assert "\n" not in words
    assert re.search(
        r"the closest has [\d.]+ kg of actuators, and group 'joint_2' \(.*\) takes [\d.]+ of "
        r"its .* in mode '(walk|stand|wait|all feet|three feet|push|slope|least torque)', margins "
        r"included; .* holding 0\.3 kg of every actuator",
        words,
    )
    weak = search_of(("maxon_402687", "maxon_gp_42_c_126"))
    with pytest.raises(LegwattError, match=r"'joint_2' \(\w+ \+ \w+\) takes [1-9][\d.]* of its "):
        _searched(weak.problem, weak.pairs)


@pytest.mark.parametrize("payload", ["2 kg", "7 kg", "13 kg", "45 kg"])
def test_the_least_power_is_that_of_all_robots_and_none_is_found_only_where_there_is_none(payload):
    changes = {PAYLOAD: payload}
    modes = (replace(WALK, changes=changes), replace(STAND, changes=changes))
    search = search_of((*MOTORS[3:], *GEARS[:2]), modes=modes)
    every = search.evaluated([*product(combinations(search.shelf), repeat=3)])
    within = every.use <= 1.0
    search.run()
    if not within.any():
        assert not search.front()
        assert search.known[search.best].use == pytest.approx(every.use.min())
        return
    least = search.known[search.front()[0]]
    assert least.use <= 1.0
    assert least.power == pytest.approx(every.power[within].min(), rel=1e-9)


def test_a_supply_of_the_least_voltage_gives_motors_what_they_ask_and_no_more(search):
    """The battery is used up to there, margins with it; answers are the ends of the front."""
    answers = _answers(search, search.front(), {})
    known = {name: search.known[answer.robot] for name, answer in answers.items()}
    assert known["lightest"].mass == min(own.mass for own in known.values())
    assert known["least power"].power == min(own.power for own in known.values())
    assert known["lightest"].mass < known["least power"].mass
    answer = answers["least power"]
    assert replace(answer, least_voltage=45.0).hours < answer.hours
    shelf = PartCatalog(search.shelf.parts, voltage=answer.least_voltage)
    low = Search(replace(search.problem, shelf=shelf), search.pairs, answer.demand)
    own = low.evaluated([answer.robot], answer.demand)
    assert max(group.use["voltage"].max() for group in own.groups) == pytest.approx(1.0)


def test_a_lighter_robot_that_takes_less_in_full_is_the_answer(search, monkeypatch):
    """The front is of motions planned for one mass; each answer's own motion decides."""
    masses = {own.mass: robot for robot, own in search.known.items()}
    front = [masses[m] for m in sorted(masses)[:-4:-1]]
    monkeypatch.setattr("pipeline.choice.choose.knee", lambda power, mass: 1)
    for sign, expected in ((1.0, (-1, -1, -1)), (-1.0, (0, 1, -1))):

        def full(search, robot, sign=sign):
            return SimpleNamespace(robot=robot, power=sign * search.known[robot].mass)

        monkeypatch.setattr("pipeline.choice.choose._in_full", full)
        answers = _answers(search, front, {})
        for name, k in zip(("least power", "knee", "lightest"), expected, strict=True):
            assert answers[name].robot == front[k]


def test_what_is_as_near_a_limit_as_those_that_exceed_it_goes_with_them(search, monkeypatch):
    """In full every robot uses 1.1 times as much: three a round are too few to get past them."""

    def full(search, robot):
        own = search.known[robot]
        use = SimpleNamespace(use=[1.1 * own.use])
        return SimpleNamespace(robot=robot, power=own.power, full=use)

    monkeypatch.setattr("pipeline.choice.choose._in_full", full)
    monkeypatch.setattr("pipeline.choice.choose._ROUNDS", 5)  # 6 without
    monkeypatch.setattr("pipeline.choice.choose._NARROWED", 2)
    found, answers, _ = _searched(search.problem, search.pairs)
    assert found.most < 1.0
    assert all(own.full.use[0] <= 1.0 for own in answers.values())


def test_a_robot_beyond_a_limit_in_the_search_alone_is_an_end_of_the_front(tmp_path):
    """With motions that are planned for another mass its thighs ask for 1.002 of the voltage."""
    (tmp_path / "day.csv").write_text("mode,share,slope\nwalk,1,8 deg\n")
    parts = ("maxon_251601", "maxon_267121", "maxon_311536", "maxon_gp_32_c_111", "maxon_gp_22_hp")
    given = {"margin_speed": 1.3, "unlisted": True, "only": parts, "draws": 8}
    own = lw.choose(lw.load("urdf/solo12.toml"), tmp_path / "day.csv", **given).chosen
    lightest = own.answers["lightest"]
    assert lightest.robot[1][0] == "maxon_267121"
    assert 0.99 < lightest.full.use[0] <= 1.0 < own.search.evaluated([lightest.robot]).use[0]


def test_envelope_is_the_least_of_each_family_at_every_share(search):
    own = envelope(search)
    for family, names in own.robots.items():
        for robot in names:
            locks = [bool(brake) or gear == "hpc_m1_120" for _, gear, brake in robot]
            assert family != NONE or not any(locks)
            assert family != ALL or all(locks)
    assert (own.power["any"] <= np.minimum(own.power[NONE], own.power[ALL]) + 1e-9).all()
    # Brakes are open while it walks, and nothing is drawn while all joints are locked.
    assert own.power[ALL][0] > own.power[NONE][0]
    assert own.power[ALL][-1] == pytest.approx(0.0, abs=1e-9)
    assert 0.3 < own.crossing < 0.95
    sides = dict.fromkeys([*own.robots[NONE], *own.robots[ALL]])
    drawn = monte_carlo(search, [*sides], 24)
    span = crossing_range(search, drawn)
    assert span[0] < own.crossing < span[1]


def test_bodies_hold_a_battery_that_is_light_beside_them():
    """Solo12 of 2.5 kg holds no pack of 2.9 kg; the hexapod of 40 kg does."""
    for name, holds in (("solo12", 0.0), ("hexapod", 2.9)):
        problem = problem_of(lw.load(f"urdf/{name}.toml"), DAY, ChooseOptions())
        assert problem.held_battery == pytest.approx(holds)
        assert problem.present == problem.machine.motors.mass[0] > 0.0  # both state their motors
        assert problem.held_battery + problem.on_base == pytest.approx(2.9)


def test_links_hold_motors_whose_mass_no_file_states():
    """Part of every link is its structure; what is in them is not counted once more."""
    for name in ("tytan", "magnecko", "anymal_c"):
        machine = lw.load(f"urdf/{name}.toml")
        problem = problem_of(machine, DAY, ChooseOptions())
        gone = with_masses(machine, problem.added(dict.fromkeys(problem.groups, 0.0)))
        masses = [body.mass for body in gone.robot.model.inertias[1:]]
        assert 0.75 < sum(masses) / machine.edited.mass < 0.85
        assert min(masses) > 0.0
        stated = problem_of(machine, DAY, ChooseOptions(present="0 kg"))
        assert (stated.present, stated.assumed, problem.assumed) == (0.0, False, True)
    light = with_masses(machine, {"LF_KFE": -2.0})
    model = light.robot.model
    thigh = model.inertias[model.parents[model.getJointId("LF_KFE")]].mass
    assert problem_of(light, DAY, ChooseOptions()).present == pytest.approx(0.5 * thigh)


def test_a_stance_that_tips_with_the_masses_of_a_robot_is_no_load_case():
    machine = lw.load("urdf/solo12.toml")
    hip = machine.robot.spec.legs[0].joints[0]
    alone, both, three = (
        {
            own[0].mode.name: [len(x.series.time) for x in own]
            for own in cases_of(machine, [STAND], m)
        }
        for m in ([{}], [{}, {hip: 1.0}], [{}, {}])
    )
    assert three == {name: own * 2 for name, own in alone.items()}
    assert both["three feet"] == both["three feet"][:1] * 2
    assert both["three feet"][0] < alone["three feet"][0]
    pushed = cases_of(machine, [STAND], [{}])[2][0].mode
    assert pushed.name == "push"
    tilt = quantity(str(pushed.changes["gait.slope_forward"]), "angle")
    assert np.tan(tilt) == pytest.approx(0.1, rel=1e-3)
    *_, (steep,) = cases_of(lw.load("urdf/tytan.toml"), [STAND], [{}])  # at 20 deg it tips one way
    assert steep.mode.changes == {"gait.slope_forward": "15 deg"}
    assert len(steep.series.time) == 1 + len(("up", "down", "left", "right"))


def test_the_cheapest_robot_is_that_of_all_whose_prices_are_at_hand():
    motors = ("maxon_539487", "maxon_496655", "maxon_311536")
    gears = ("maxon_gp_32_c_111", "maxon_gp_42_c_126", "hd_csg_14_100")
    own = search_of((*motors, *gears), "urdf/solo12.toml", step=8)
    own.run()
    every = own.evaluated([*product(own.pairs, repeat=3)])
    price = every.total("price", own.counts)[every.use <= 1.0]
    cheapest = _answers(own, own.front(), {})["cheapest"].robot
    assert own.known[cheapest].price == pytest.approx(np.nanmin(price))
    assert np.isnan(price).any()


def test_load_cases_carry_the_greatest_payload_of_the_day():
    machine = lw.load("urdf/solo12.toml")
    light, heavy = (replace(STAND, changes={PAYLOAD: own}) for own in ("0.09 kg", "0.8 kg"))
    most, own, none = (
        np.abs(cases_of(machine, modes, [{}])[0][0].series.torque)
        for modes in ((light, heavy, STAND), (heavy,), (STAND,))
    )
    assert np.allclose(most, own)
    assert own.max() > 1.2 * none.max()


def test_groups_are_joints_alike_or_those_stated_each_joint_in_one():
    spec = lw.load("urdf/solo12.toml").robot.spec
    assert [*groups_of(spec)] == ["HAA", "HFE", "KFE"]
    assert _shared(["front_left_knee_roll", "hind_right_knee_roll"], "", {}) == "knee_roll"
    assert _shared(["kneeL", "kneeR"], "", {}) == "knee"
    assert _shared(["a", "b"], "joint 3", {}) == "joint 3"
    hind = groups_of(spec, ("hips=*_HAA", "front=F?_HFE,F?_KFE", "hind=H?_[HK]FE"))
    assert [len(joints) for joints in hind.values()] == [4, 4, 4]
    assert hind["hind"] == ("HL_HFE", "HL_KFE", "HR_HFE", "HR_KFE")
    for given, words in (
        (("all=*", "hips=*_HAA"), "'FL_HAA' is in 2 groups"),
        (("hips=*_HAA",), "'FL_HFE' is in 0 groups"),
        (("hips=*_HAB",), "NAME=PATTERN"),
    ):
        with pytest.raises(LegwattError, match=words):
            groups_of(spec, given)


def test_fronts_add_and_have_a_knee_and_differences_cross():
    rng = np.random.default_rng(1)
    fronts = []
    for power, mass in rng.random((3, 2, 30)):
        own = front(power, mass)
        fronts.append((power[own], mass[own]))
    power, mass, taken = merged(fronts)
    every_p = sum(np.meshgrid(*(p for p, _ in fronts), indexing="ij")).ravel()
    every_m = sum(np.meshgrid(*(m for _, m in fronts), indexing="ij")).ravel()
    own = front(every_p, every_m)
    assert np.allclose(power, every_p[own])
    assert np.allclose(mass, every_m[own])
    assert np.allclose(power, sum(p[taken[:, k]] for k, (p, _) in enumerate(fronts)))
    assert knee(np.array([10.0, 10.2, 12.0, 20.0]), np.array([20.0, 12.0, 11.7, 11.0])) == 1
    assert knee(np.array([10.0, 20.0]), np.array([5.0, 4.0])) == 0
    shares = np.array([0.0, 0.5, 1.0])
    assert crossing(shares, np.array([3.0, 1.0, -1.0])) == pytest.approx(0.75)
    assert crossing(shares, np.array([3.0, 2.0, 1.0])) is None


def test_an_actuator_sits_on_the_link_before_its_joint_and_a_battery_on_the_base():
    machine = lw.load("urdf/solo12.toml")
    model, (hip, *_) = machine.robot.model, machine.robot.spec.legs[0].joints
    ((own,),) = loads_of(machine, [STAND], [{model.names[1]: 0.7}])
    ((payload,),) = loads_of(machine, [replace(STAND, changes={PAYLOAD: "0.7 kg"})])
    assert np.allclose(own.series.torque, payload.series.torque, atol=1e-9)
    heavier = with_masses(machine, {hip: 0.5}).robot.model.inertias
    more = [a.mass - b.mass for a, b in zip(heavier, model.inertias, strict=True)]
    assert np.flatnonzero(more).tolist() == [model.parents[model.getJointId(hip)]]


def test_answers_are_searched_about_their_own_mass_where_they_exceed_a_limit_with_it(monkeypatch):
    """A robot whose links hold nothing walks another way with 26 kg of actuators."""
    monkeypatch.setattr("pipeline.choice.choose._ANEW", 1)
    parts = ("maxon_500267", "maxon_353297", "cubemars_ak80_64", "hd_csg_20_160", "hd_csg_25_160")
    own = lw.choose(lw.load("b1"), present="0 kg", margin_speed=1.12, only=parts, draws=8).chosen
    assert {answer.full.use[0] <= 1.0 for answer in own.answers.values()} == {True}
    assert 25.0 < own.search.known[own.best.robot].mass < 30.0
    assert own.search.demand.mass.min() > 0.5  # of an actuator with which motions were planned
