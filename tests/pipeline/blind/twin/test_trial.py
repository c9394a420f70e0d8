from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.blind.twin import trial as trial_module
from pipeline.blind.twin.controller import Plan
from pipeline.blind.twin.effects import CATALOGUE, EFFECTS, UNCATALOGUED, Hidden, draw, effect_named
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.files import csv_bytes, sealed_bytes, write_trial
from pipeline.blind.twin.reference import Reference, reference
from pipeline.blind.twin.sensors import NOISE_LEVELS, measure
from pipeline.blind.twin.setup import Setup, nominal_setup, stream, with_tolerances
from pipeline.blind.twin.trajectories import leg_plan
from pipeline.blind.twin.trial import make_trial, plan_of
from pipeline.blind.twin.walking import walking_plan

#: The names the workflow's catalogue promises.
PROMISED = {
    *("coulomb_friction", "viscous_friction", "stribeck_friction", "load_dependent_friction"),
    *("direction_dependent_friction", "backdrive_loss", "rotor_inertia", "link_mass"),
    *("center_of_mass_offset", "base_tilt", "joint_elasticity", "backlash", "torque_ripple"),
    *("transmission_coupling", "parallel_spring", "torque_constant_error", "winding_heating"),
    *("effort_offset", "position_offset", "time_delay", "internal_foot_force"),
}


def cut(plan: Plan, samples: int) -> Plan:
    return replace(
        plan,
        position=plan.position[:samples],
        velocity=plan.velocity[:samples],
        feedforward=plan.feedforward[:samples],
    )


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials of one second; squeezing feet plan their own walk, which is cut, too."""
    monkeypatch.setattr(trial_module, "plan_of", lambda *a: cut(plan_of(*a), 1000))
    monkeypatch.setattr(
        "pipeline.blind.twin.effects.bodies.walking_plan",
        lambda robot, **options: cut(walking_plan(robot, **options), 1000),
    )


@pytest.fixture(scope="module")
def leg_reference() -> Reference:
    robot = trial_module.load_robot(trial_module.load_robot_file(trial_module.ROBOT_FILES["leg"]))
    plan = leg_plan(robot, np.random.default_rng(0))
    machine = trial_module.load_machine()
    return reference(nominal_setup(robot, machine, plan, NOISE_LEVELS["low"]))


def test_catalogue_is_complete_and_some_effects_are_outside_it() -> None:
    assert set(CATALOGUE) == PROMISED
    assert len(UNCATALOGUED) >= 3


@pytest.mark.usefixtures("short")
def test_same_seed_same_bytes() -> None:
    first, second = (make_trial(7, "coulomb_friction", noise="high") for _ in range(2))
    assert csv_bytes(first.logs["log"]) == csv_bytes(second.logs["log"])
    assert sealed_bytes(first.truth) == sealed_bytes(second.truth)
    other = make_trial(8, "coulomb_friction", noise="high")
    assert csv_bytes(first.logs["log"]) != csv_bytes(other.logs["log"])


@pytest.mark.usefixtures("short")
def test_hiding_something_else_leaves_machine_and_noise_alone() -> None:
    plain = make_trial(7)
    late = make_trial(7, "effort_offset")
    assert plain.truth["tolerances"] == late.truth["tolerances"]
    bias = late.truth["hidden"][0]
    joint, value = bias["place"][0], bias["parameters"]["current"]["value"]
    for name, column in plain.logs["log"].items():
        shift = value if name == f"{joint}__current_A" else 0.0
        np.testing.assert_allclose(late.logs["log"][name] - column, shift, atol=1e-12)


@pytest.mark.parametrize("motion", ["leg", pytest.param("walk", marks=pytest.mark.slow)])
@pytest.mark.usefixtures("short")
def test_every_effect_can_be_hidden_and_changes_the_log(motion: str) -> None:
    plain = make_trial(5, motion=motion).logs["log"]
    for name, effect in EFFECTS.items():
        if motion not in effect.motions:
            continue
        trial = make_trial(5, name, motion)
        (hidden,) = trial.truth["hidden"]
        assert hidden["effect"] == name
        assert all(np.isfinite(p["value"]) for p in hidden["parameters"].values())
        log = trial.logs["log"]
        n = min(log["time_s"].size, plain["time_s"].size)
        assert all(np.isfinite(column).all() for column in log.values())
        assert any(not np.array_equal(log[key][:n], plain[key][:n]) for key in log), name


@pytest.mark.parametrize(
    "name",
    [
        "rotor_inertia",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in (
                *("coulomb_friction", "viscous_friction", "parallel_spring", "link_mass"),
                *("transmission_coupling", "base_tilt", "torque_ripple", "torque_constant_error"),
                *("sticking_spot", "quadratic_drag"),
            )
        ),
    ],
)
def test_an_effect_has_the_torque_it_was_drawn_for(leg_reference: Reference, name: str) -> None:
    setup = leg_reference.setup
    effect, rng = EFFECTS[name], np.random.default_rng(2)
    hidden = effect.draw(rng, leg_reference, 20 * leg_reference.noise_torque)
    machine = setup.plant.machine
    currents = [s.run().current for s in (setup, effect.apply(setup, hidden))]
    change = np.sqrt(np.mean((currents[1] - currents[0]) ** 2, axis=0)).max()
    seen = machine.ratio * machine.torque_constant * change
    assert seen == pytest.approx(hidden.expected_torque, rel=0.3)


def hidden_coulomb(joint: str, torque: float) -> Hidden:
    return Hidden("coulomb_friction", (joint,), {"torque": torque}, {"torque": "N*m"})


@pytest.mark.usefixtures("short")
def test_explicit_effect_is_hidden_as_given() -> None:
    truth = make_trial(1, [hidden_coulomb("rm_joint_2", 1.5), "time_delay"]).truth["hidden"]
    assert truth[0]["place"] == ["rm_joint_2"]
    assert truth[0]["parameters"]["torque"] == {"value": 1.5, "unit": "N*m"}
    assert truth[1]["effect"] == "time_delay"


def test_hidden_coulomb_friction_shows_in_the_current(leg_reference: Reference) -> None:
    """Mean current of slow motion one way less the other way is twice the friction."""
    setup = leg_reference.setup
    angle = np.concatenate([np.linspace(0.1, 0.5, 2000), np.linspace(0.5, 0.1, 2000)])
    position = np.column_stack([angle, 0 * angle, 0 * angle])  # about the vertical axis: no weight
    rate = np.gradient(position, 1e-3, axis=0)
    setup = replace(setup, plan=Plan(1e-3, position, rate, 0 * position, 0.0))
    machine = setup.plant.machine
    k = machine.ratio * machine.torque_constant
    found = []
    for torque in (0.0, 1.5):
        item = hidden_coulomb("rm_joint_1", torque)
        record = EFFECTS["coulomb_friction"].apply(setup, item).run()
        ahead, back = record.current[1000:3500, 0], record.current[5000:7500, 0]
        found.append(0.5 * k * (ahead.mean() - back.mean()))
    assert found[1] - found[0] == pytest.approx(1.5, rel=0.01)


def test_measurement_averages_delays_and_quantises(leg_reference: Reference) -> None:
    setup = replace(leg_reference.setup, plan=cut(leg_reference.setup.plan, 2500))
    record = setup.run()
    quiet = replace(NOISE_LEVELS["low"], current=0.0, voltage=0.0, torque=0.0)
    sensors = replace(setup.sensors, noise=quiet, efforts=("current", "torque"))
    robot = setup.plant.robot

    def log(**changes: float) -> dict[str, np.ndarray]:
        changed = replace(sensors, **changes)
        return measure(robot, record, changed, 0.2, 1e-6, np.random.default_rng(0))

    prompt, late = log(), log(delay=0.01)
    np.testing.assert_allclose(np.diff(prompt["time_s"]), 0.002)
    np.testing.assert_array_equal(
        late["rm_joint_2__current_A"][5:], prompt["rm_joint_2__current_A"][:-5]
    )
    step = quiet.encoder_step
    steps = prompt["rm_joint_1__position_rad"] / step
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    at = round(0.2 / record.dt)
    block = record.current[at - 2 : at + 3, 1]
    assert prompt["rm_joint_2__current_A"][0] == pytest.approx(
        block @ [0.125, 0.25, 0.25, 0.25, 0.125]
    )
    with pytest.raises(TwinError, match="does not divide"):
        log(rate=333.0)


def test_tolerances_stay_inside_what_is_stated(leg_reference: Reference) -> None:
    setup: Setup = leg_reference.setup
    for seed in range(20):
        _, drawn = with_tolerances(setup, seed)
        assert all(abs(f - 1) <= 0.03 for f in drawn["mass_factor"].values())
        assert all(abs(f - 1) <= 0.02 for f in drawn["torque_constant_factor"].values())
        assert all(abs(z) <= 2e-3 for z in drawn["encoder_zero_rad"].values())


def test_draws_of_one_purpose_do_not_move_another() -> None:
    assert stream(3, "noise").random() == stream(3, "noise").random()
    assert stream(3, "noise").random() != stream(3, "motion").random()


def test_strength_is_the_torque_over_the_noise(leg_reference: Reference) -> None:
    hidden = draw(EFFECTS["viscous_friction"], np.random.default_rng(1), leg_reference)
    assert hidden.strength == pytest.approx(hidden.expected_torque / leg_reference.noise_torque)


@pytest.mark.usefixtures("short")
def test_folder_holds_no_truth_and_the_seal_keeps_its_hash(tmp_path: Path) -> None:
    trial = make_trial(2, "viscous_friction", logs=2)
    files = write_trial(trial, tmp_path / "trial", tmp_path / "sealed" / "2.json")
    assert hashlib.sha256(files.sealed.read_bytes()).hexdigest() == files.sha256
    assert json.loads(files.sealed.read_bytes())["hidden"][0]["effect"] == "viscous_friction"
    assert [log.name for log in files.logs] == ["log.csv", "log_2.csv"]
    for path in (tmp_path / "trial").rglob("*"):
        if path.is_file() and path.suffix != ".toml":
            assert b"viscous_friction" not in path.read_bytes()
    header = files.logs[0].read_text().splitlines()[0].split(",")
    assert header[:3] == ["time_s", "rm_joint_1__position_rad", "rm_joint_1__current_A"]
    assert trial_module.load_robot_file(files.robot).joints == trial.robot.joints
    table = np.genfromtxt(files.logs[0], delimiter=",", names=True, deletechars="")
    np.testing.assert_array_equal(
        table["rm_joint_2__voltage_V"], trial.logs["log"]["rm_joint_2__voltage_V"]
    )
    with pytest.raises(TwinError, match="not empty"):
        write_trial(trial, tmp_path / "trial", tmp_path / "sealed" / "2.json")
    with pytest.raises(TwinError, match="own folder"):
        write_trial(trial, tmp_path / "new", tmp_path / "new" / "truth.json")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"effects": "colomb_friction"}, "did you mean 'coulomb_friction'"),
        ({"effects": "internal_foot_force"}, "cannot act in motion 'leg'"),
        ({"motion": "wlak"}, "did you mean 'walk'"),
        ({"noise": "lo"}, "did you mean 'low'"),
        ({"seed": -1}, "negative"),
    ],
)
def test_wrong_requests_are_answered_in_one_line(arguments: dict, message: str) -> None:
    with pytest.raises(TwinError, match=message) as caught:
        make_trial(**({"seed": 0} | arguments))
    assert "\n" not in str(caught.value)
    assert effect_named("backlash", "leg").name == "backlash"


def test_walk_leaves_forces_that_carry_the_robot() -> None:
    log = make_trial(1, motion="walk").logs["log"]
    legs = ("lf", "lm", "lr", "rf", "rm", "rr")
    vertical = sum(log[f"{leg}_foot_link__force_z_N"] for leg in legs)
    assert np.mean(vertical) == pytest.approx(40 * 9.81, rel=0.02)  # masses within 3 %
    assert np.abs(log["base__roll_rad"]).max() < 0.03
    single = np.mean([(log[f"{leg}_foot_link__force_z_N"] > 5).astype(float) for leg in legs])
    assert 0.45 < single < 0.75  # tripods take turns, with some time on all six
