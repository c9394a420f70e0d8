"""Joints with actuators of their own: the robot file's table, held against closed forms."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pipeline as lw
from actuators.chain import Chain
from actuators.elements.element import Friction, Inertia, Ratio
from actuators.energy import stage_energies
from actuators.errors import LegwattError
from actuators.loading.build import CATALOG, load_catalog
from actuators.shaft import DCMotor, ShaftSeries
from pipeline.commands.robots import load
from pipeline.logs.log import Log
from pipeline.machine.machine import Drivetrains, MachineModel
from pipeline.machine.own_actuators import AS_BUILT
from pipeline.simulation.machine import Machine
from pipeline.simulation.predict import Simulator
from tests.command_line import base_model
from tests.pipeline.identification import bench_leg as leg

OWN = """
[actuators]
alternative = "reversible"

[[actuators.joint]]
joints = ["*_joint_1", "rm_joint_3"]
alternative = "rotor"

[[actuators.joint]]
joints = ["*_joint_2"]
[actuators.joint.parameters]
ratio = {value = 160, unit = "1", basis = "datasheet", source = "an example"}
torque_constant = {value = 60, unit = "mN*m/A", basis = "datasheet", source = "an example"}
"""


def robot_file(root: Path, folder: Path, table: str, robot: str = "hexapod") -> Path:
    path = folder / "robot.toml"
    head = f'extends = "{root}/urdf/{robot}.toml"\n[robot]\nurdf = "{root}/urdf/{robot}.urdf"\n'
    path.write_text(head + table, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def given(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Machine:
    return load(robot_file(root, tmp_path_factory.mktemp("own"), OWN)).walking(samples=51)


def test_a_joint_of_its_own_takes_what_its_ratio_and_its_constant_say(given):
    """As built every joint takes what its own option takes."""
    chains, joints = given.chains(), given.robot.joints
    walking, standing = given.walk(chains), given.stand(chains)
    second = np.array([name.endswith("_joint_2") for name in joints])
    ratio, constant = np.where(second, 160.0, 400.0), np.where(second, 60e-3, 30.186992e-3)
    expected = standing.demand.torque[0] / ratio / constant
    np.testing.assert_allclose(standing.holding["ideal"].current, expected, rtol=1e-12)
    assert list(chains) == ["ideal", "rotor", "reversible", "irreversible", AS_BUILT]
    drawn = {name: stage_energies(r)["el"][0] for name, r in walking.results.items()}
    for k, joint in enumerate(joints):
        alone = "rotor" if joint.endswith("_1") or joint == "rm_joint_3" else "reversible"
        assert drawn[AS_BUILT][k] == pytest.approx(drawn[alone][k], rel=1e-12)
        assert standing.holding[AS_BUILT].power[k] == standing.holding[alone].power[k]
    # The gear next to the motor meets the total ratio.
    geared = (
        ("reversible", "harmonic_drive", "timing_belt"),
        ("irreversible", "hypoid", "planetary"),
    )
    for name, kept, free in geared:
        joint = given.own.actuators(name).joints[joints.index("lf_joint_2")]
        ratios = {e.name: e.gearing for e in joint.elements if e.gearing != 1.0}
        stock = load_catalog().parameter(f"{kept}.ratio").value
        assert ratios == pytest.approx({kept: stock, free: 160.0 / stock})


JOINT = '[[actuators.joint]]\njoints = ["rm_joint_2"]\n'
NUMBER = '{value = 160, unit = "1", basis = "datasheet", source = "x"}'


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('[actuators]\nalternative = "rotr"\n', "no alternative 'rotr': did you mean 'rotor'"),
        ("actuators = 3\n", "Input should be a valid dictionary, not 3"),
        ('[actuators]\nfolder = "ours"\n', r"actuators\.folder: no folder"),
        ('[[actuators.joint]]\njoints = ["rm_joint_9"]\n', "joint 1: no joint 'rm_joint_9': did"),
        (JOINT + 'alternative = "rotor"\n', "as what is joint 'lf_joint_1' built"),
        (JOINT + f"parameters.ratioo = {NUMBER}\n", "unknown parameter 'ratioo': did you mean"),
        (JOINT + f"parameters.torque_constant = {NUMBER}\n", "'1' is a unit of ratio, expected"),
        (JOINT + f'parameters."timing_belt.ratio" = {NUMBER}\n', "joint 'rm_joint_2'.*change them"),
        (JOINT + f"parameters.ratio = {NUMBER.replace('160', '-1')}\n", "ratio must be positive"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_in_one_line(root, tmp_path, table, message):
    path = robot_file(root, tmp_path, "" if table.startswith("actuators") else table)
    if table.startswith("actuators"):
        path.write_text(table + path.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(LegwattError, match=message) as error:
        load(path)
    assert "\n" not in str(error.value)


def test_what_is_found_against_the_machine_as_built_counts_there_alone(given):
    friction = ("coulomb_friction", "rm_joint_2", {"torque": 2.0})
    edited = given.with_effect(*friction, alternative=AS_BUILT).walking(samples=51)
    walking = edited.walk(edited.chains())
    told = [n for n, r in walking.results.items() if "coulomb_friction" in r.losses]
    assert told == [AS_BUILT]
    base = base_model(edited.model_file)
    assert base.actuator("rm_joint_2").ratio == pytest.approx(160.0)


def test_a_catalogue_without_the_ideal_or_with_one_option_walks(root, tmp_path):
    folder = tmp_path / "ours"
    shutil.copytree(CATALOG, folder)
    file = folder / "alternatives.toml"
    text = file.read_text(encoding="utf-8")
    start, end = (text.index(f"[{name}]\n") for name in ("reversible", "irreversible"))
    file.write_text(text[start:end].replace("reversible", "geared"), encoding="utf-8")
    machine = load(robot_file(root, tmp_path, '[actuators]\nfolder = "ours"\n'))
    energy = lw.walk(machine, samples=51).energy
    assert set(energy["alternative"]) == {"geared"}
    file.write_text(text + text[start:end].replace("[reversible", f"[{AS_BUILT}"), "utf-8")
    with pytest.raises(LegwattError, match="is called 'as_built'"):
        load(robot_file(root, tmp_path, OWN), actuators=folder)
    assert energy["ratio_to_ideal"].isna().all()


RATIO, CONSTANT, TURNS = 50.0, 0.04, 0.3
#: theta = C q at the joint side: joint 3's motor turns with joint 2, too.
C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, TURNS, 1.0]])
LOSSLESS = Chain(
    "lossless",
    (Ratio("gear", ratio=RATIO),),
    DCMotor("motor", torque_constant=CONSTANT, resistance=0.5),
    {"m": "gear"},
)


def actuators() -> tuple[Chain, ...]:
    names = leg.leg_model().joints
    plain = tuple(Chain(name, elements=LOSSLESS.elements, motor=LOSSLESS.motor) for name in names)
    return (*plain[:2], replace(plain[2], coupled_to=names[1], coupling=TURNS))


@pytest.fixture(scope="module")
def motion() -> Log:
    return leg.leg_motion(duration=4.0)


@pytest.fixture(scope="module")
def machine() -> MachineModel:
    return replace(leg.leg_model(), drivetrains=Drivetrains("coupled", actuators()))


def lossy() -> tuple[Chain, ...]:
    """Friction of every kind at the joint side, between frame and motor, and a rotor."""
    rubbing = Friction("friction", coulomb=2.0, load=0.1, viscous=1.5)
    rotor = Inertia("rotor", inertia=2e-4)
    return tuple(replace(a, elements=(rubbing, *a.elements, rotor)) for a in actuators())


def sealed() -> tuple[Chain, ...]:
    """And friction at joint 3's own side, which does not turn with the coupled motor."""
    *others, third = lossy()
    return (*others, third.with_output(Friction("seal", coulomb=0.2, viscous=0.3)))


def test_walking_with_a_coupling_and_losses_every_watt_is_accounted_for(motion):
    torque = np.random.default_rng(1).normal(size=motion.q.shape) * 20.0
    joint = ShaftSeries.at_joint(motion.joints, motion.time, motion.q, motion.v, motion.a, torque)
    result = Drivetrains("lossy", sealed()).inverse(joint)
    seal = 0.2 * np.abs(joint.velocity[:, 2]) + 0.3 * joint.velocity[:, 2] ** 2
    np.testing.assert_allclose(result.losses["seal"][:, 2], seal)
    assert not result.losses["seal"][:, :2].any()
    lost = sum(x.sum(axis=1) for x in (*result.losses.values(), *result.stored.values()))
    taken = joint.power.sum(axis=1)
    drawn = result.electrical_power.sum(axis=1)
    np.testing.assert_allclose(drawn, taken + lost, atol=1e-9 * np.abs(drawn).max())


def test_walking_and_prediction_ask_the_same_of_coupled_motors(motion, machine):
    model = replace(machine, drivetrains=Drivetrains("sealed", sealed()))
    predicted = Simulator(motion).predict(model)
    walked = model.drivetrains.inverse(
        ShaftSeries.at_joint(
            motion.joints, motion.time, motion.q, motion.v, motion.a, predicted.torque
        )
    )
    least = np.minimum(np.abs(motion.v @ C.T), np.abs(motion.v))
    fast = (least > 20.0 * motion.rest_speed).all(axis=1)  # no sign in doubt
    assert fast.sum() > 100
    np.testing.assert_allclose(
        RATIO * walked.motor.torque[fast], predicted.motor_torque[fast], rtol=1e-12, atol=1e-9
    )


def test_standing_with_a_coupling_the_friction_of_a_motor_is_its_own():
    """What a joint's friction holds, its motor need not; the other joint feels the whole load."""
    torque = np.array([3.0, -7.0, 5.0])
    held = Drivetrains("lossy", lossy()).holding(torque)
    load = np.linalg.solve(C.T, torque)
    for k in range(3):
        friction = 2.0 + 0.1 * abs(load[k])
        ends = (load[k] - friction) / RATIO, (load[k] + friction) / RATIO
        np.testing.assert_allclose((held.low[k], held.high[k]), ends, atol=1e-12)
    assert held.motor_torque[0] == pytest.approx((3.0 - 2.3) / RATIO)


def test_play_is_odd_nothing_without_load_and_ends_at_its_flanks():
    width, stiffness, crossing = 0.01, 1e3, 0.2
    joint = Chain("a", compliance=1.0 / stiffness, backlash=width, crossing=crossing)
    lag = joint.deflection(np.array([-5.0, -0.05, 0.0, 0.05, 5.0]))
    np.testing.assert_allclose(lag, -lag[::-1], atol=1e-12)
    # On a flank: half the width and what the flank gives.
    assert lag[-1] == pytest.approx(0.5 * width + 5.0 / stiffness, rel=1e-6)
    # Between the flanks the slope is that of width / (2 crossing) beside the stiffness.
    assert lag[3] == pytest.approx(0.05 * (0.5 * width / crossing + 1.0 / stiffness), rel=0.03)
