"""A loaded robot: joints in no leg, edges of its numbers, its own motors, what is refused."""

from contextlib import nullcontext

import numpy as np
import pytest

import pipeline as lw
from actuators.checked import read_toml
from actuators.errors import LegwattError
from actuators.loading.build import load_catalog
from actuators.parameters import ParameterSet
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import KNOWN, TABLE, check_parameters, known_motors, load_robot_file
from tests.pipeline.robot.walkers import MIXED, robot_text, urdf_text, walker

LEG1, FOOT1 = '["leg1_0", "leg1_1"]', 'foot = "leg1_foot"'


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return walker(tmp_path_factory.mktemp("mixed"), MIXED, arm=True)


def test_joints_outside_the_legs_are_held_and_their_torque_is_told(mixed):
    assert mixed.joints[-1] == "arm"
    q = np.zeros((1, *mixed.chains.columns.shape))
    configuration = mixed.configuration(mixed.joint_positions(q), np.zeros((1, 3)))
    still = mixed.tangent(mixed.chains.by_joint(q))
    segment = Segment("still", np.zeros(1), configuration, still, still, mixed.leg_names)
    demand, _ = segment_demand(mixed, segment)
    assert demand.position[0, -1] == 0.4
    # 0.7 kg at (0.01, -0.05) m of the joint's x and z, turned by 0.4 rad about y.
    ahead = 0.01 * np.cos(0.4) - 0.05 * np.sin(0.4)
    assert demand.torque[0, -1] == pytest.approx(-0.7 * 9.81 * ahead, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("arm = 0.4", "arn = 0.4", "the URDF has no joint 'arn': did you mean 'arm'"),
        ("arm = 0.4", "arm = 0.4\nleg0_1 = 0", "held.leg0_1: the joint belongs to leg 'leg0'"),
        (LEG1, '["leg1_0", "leg0_1"]', "joint 'leg0_1' belongs to two legs"),
        ('side = "left"', 'side = "port"', "'legs.leg0.side': 'port': known: left, right"),
        (FOOT1, f"{FOOT1}\nstart_posture = [0]", "as many numbers as there are joints, 2"),
        (LEG1, '["leg1_0", "leg1_tip"]', "no joint that moves 'leg1_tip'"),
        (LEG1, '["leg1_1", "leg1_0"]', "outward from base to foot 'leg1_foot': leg1_0, leg1_1"),
        (FOOT1, 'foot = "leg1_fot"', "no frame 'leg1_fot': .* 'leg1_foot'"),
        (FOOT1, 'foot = "leg2_foot"', "from base to foot 'leg2_foot': leg2_0"),
        ('"leg1_0" type="revolute"', '"leg1_0" type="planar"', "'leg1_0' is of several coord"),
    ],
)
def test_what_cannot_be_loaded(tmp_path, old, new, message):
    urdf, text = urdf_text(MIXED, arm=True), robot_text(MIXED, arm=True)
    assert old in urdf + text
    (tmp_path / "walker.urdf").write_text(urdf.replace(old, new), encoding="utf-8")
    path = tmp_path / "walker.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(LegwattError, match=message):
        load_robot(load_robot_file(path))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tibia_com": 1.001}, "tibia_com = .* lies outside 0 to 1"),
        ({"foot_lift": 0.0, "coxa_length": 0.0, "gravity": 30.0, "trunk_com_left": -10.0}, ""),
        ({"foot_lift": 0.999e-3}, "foot_lift = .* lies outside 0.001 to 10"),
        ({"gravity": 30.001}, "gravity = .* lies outside 1e-09 to 30"),
        ({"coxa_length": 0.2, "joint_2_lateral": 0.2}, ""),
        ({"coxa_length": 0.2, "joint_2_lateral": 0.19}, "joint_2_lateral is smaller than coxa"),
    ],
)
def test_edges_of_what_a_built_robot_can_have(hexapod, values, message):
    changed = {name: {"value": x, "bounds": None, "interval": None} for name, x in values.items()}
    rows = hexapod.spec.parameters.rows()
    every = tuple(p.model_copy(update=changed.get(p.name, {})) for p in rows)
    with pytest.raises(LegwattError, match=message) if message else nullcontext():
        check_parameters(ParameterSet(every, "here"), "hexapod", "here")


def test_a_file_that_extends_another_keeps_what_it_does_not_say(root, tmp_path):
    """Key by key, but legs as a whole."""
    base = load_robot_file(root / "urdf" / "hexapod.toml")
    leg = '[legs.rm]\njoints = ["a", "b", "c"]\nfoot = "f"\nside = "right"\nstation = "middle"\n'
    text = f'extends = "{base.path}"\n[robot]\nname = "other"\n{leg}[standing]\nfeet = ["rm"]\n'
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    spec = load_robot_file(tmp_path / "own.toml")
    assert (spec.name, spec.standing_feet, spec.leg_names) == ("other", ("rm",), ("rm",))
    assert (spec.robot.base_link, spec.gait) == (base.robot.base_link, base.gait)
    assert dict(spec.parameters) == dict(base.parameters)
    assert [p.name for p in spec.sources] == ["own.toml", "hexapod.toml"]


SOLO = [f"{leg}_{joint}" for leg in ("FL", "FR", "HL", "HR") for joint in ("HAA", "HFE", "KFE")]


def test_a_robot_is_known_by_its_name_and_all_of_its_joints():
    found = known_motors(("solo12",), SOLO)
    assert found["folder"] == "known:solo12"
    assert known_motors(("mine", "solo"), SOLO) is not None  # by the URDF's own name
    assert known_motors(("mine", "yours"), SOLO) is None
    assert known_motors(("solo12",), [*SOLO, "arm"]) is None
    assert known_motors(("solo12",), [j for j in SOLO if not j.endswith("HAA")]) is None  # Solo8


def test_every_known_folder_loads_is_in_the_table_and_states_where_numbers_come_from():
    table = read_toml(TABLE)
    assert sorted(table) == sorted(path.name for path in KNOWN.iterdir() if path.is_dir())
    for name, own in table.items():
        catalog, joints = load_catalog(KNOWN / name), own.get("joint", ())
        every = {one["alternative"] for one in (own, *joints) if "alternative" in one}
        assert set(catalog.alternatives) == {"ideal"} | every
        assert all(number.source for _, number in catalog.rows())


def test_solo12s_copper_loss_while_standing_is_its_torque_over_its_motor_constant():
    """Closed form: joule heat is sum (tau / n - friction)^2 R / k^2, within what friction holds."""
    machine = lw.load("solo12")
    standing = lw.stand(machine, actuator="solo12").result
    torque = standing.demand.torque[0]
    motor = machine.catalog.components["motor"].parameters
    per_watt = motor["resistance"] / (9 * motor["torque_constant"]) ** 2  # [W/(N*m)^2]
    most = per_watt * float((torque**2).sum())
    power = float(standing.holding["solo12"].power.sum())
    assert 0.5 * most < power < most
    assert per_watt == pytest.approx(6.89, rel=1e-3)
