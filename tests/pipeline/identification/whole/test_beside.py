"""Findings beside bodies and friction: put into a machine they do what the regression saw."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from pipeline.effects.base import CHANNEL_COLUMNS
from pipeline.identification.results import APPROXIMATE, CONFIRMED
from pipeline.identification.whole.beside import besides, kinds_of, names_of, unnamed
from pipeline.identification.whole.findings import offsets
from pipeline.identification.whole.fit import with_found
from pipeline.identification.whole.told import Told
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel, machine_of_urdf
from pipeline.regression.laws.extras import EVERY, Extra, Kind
from pipeline.regression.result import Beside, Level, Term
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification.whole.test_whole_machine import NAMES, urdf

Array = NDArray[np.float64]
WAVE = np.array([0.3, 0.5, 0.4]) * 2 * np.pi
SIZE, PHASE = np.array([0.6, 0.5, 0.8]), np.array([0.0, 1.0, 2.0])


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> MachineModel:
    robot = tmp_path_factory.mktemp("arm") / "arm.urdf"
    robot.write_text(urdf(), encoding="utf-8")
    return machine_of_urdf(Path(robot))


def motion(t: Array) -> tuple[Array, Array, Array]:
    at = np.outer(t, WAVE) + PHASE
    return SIZE * np.sin(at), SIZE * WAVE * np.cos(at), -SIZE * WAVE**2 * np.sin(at)


def measurement(at_motor: bool = False) -> Measurement:
    t = np.arange(0, 6, 0.005)
    q, v, a = motion(t)
    n = t.size
    return Measurement(
        "made", t, NAMES, q, v, a, ("torque",), np.zeros((n, 3, 1)), np.full((3, 1), 0.01),
        np.ones((n, 3), np.bool_), np.zeros(n, np.int8), np.zeros(n, np.intp), (slice(0, n),),
        rest_speed=np.full(3, 1e-3), at_motor=at_motor,
    )  # fmt: skip


SEEN = measurement()


def dynamics(model: MachineModel, q: Array, v: Array, a: Array) -> Array:
    data = model.rigid.createData()
    return np.array([pin.rnea(model.rigid, data, *row) for row in zip(q, v, a, strict=True)])


def result(
    *extras: tuple[Extra, Sequence[float]],
    offset: dict[str, float] | None = None,
    level: Level = Level.CONFIRMED,
    rivals: tuple[Extra, ...] = (),
    gain: Sequence[float] = (1.0, 1.0, 1.0),
    names: Sequence[str] = NAMES,
) -> SimpleNamespace:
    """As a regression would give it."""
    found = tuple(
        Beside(e, np.array(x), 0.1 * np.abs(x), 0.97, rivals, 0.5, level) for e, x in extras
    )
    terms = tuple(
        Term(
            place=name, term="offset", kind="offset", unit="N*m", value=x, low=x - 0.1,
            high=x + 0.1, share=0.9, closes=0.5, level=Level.CONFIRMED,
        )
        for name, x in (offset or {}).items()
    )  # fmt: skip
    friction = tuple(SimpleNamespace(joint=n) for n in names)
    return SimpleNamespace(extras=found, terms=terms, friction=friction, gain=np.array(gain))


def effort(model: MachineModel, told: Sequence[Told], seen: Measurement = SEEN) -> Array:
    """What the sensors of a machine with some findings show, (N, J) [N*m]."""
    for one in told:
        model = with_found(model, one.found(1, "N*m"))
    return Simulator(seen).predict(model).effort[..., 0]


def alone(told: Sequence[Told]) -> tuple[str, tuple[str, ...], dict[str, float]]:
    (one,) = told
    (member,) = one.members
    return one.effect, member.place, member.values


def test_a_ripple_in_the_machine_is_the_sine_and_cosine_that_were_fitted(machine) -> None:
    told = besides(result((Extra(Kind.RIPPLE, 1, 23.0), [0.3, -0.2])), machine, "torque")
    name, place, values = alone(told)
    assert (name, place) == ("torque_ripple", ("joint_2",))
    assert values["amplitude"] == pytest.approx(np.hypot(0.3, 0.2))
    more = effort(machine, told) - effort(machine, [])
    turn = 23.0 * SEEN.q[:, 1]
    np.testing.assert_allclose(more[:, 1], 0.3 * np.sin(turn) - 0.2 * np.cos(turn), atol=1e-9)
    np.testing.assert_allclose(more[:, [0, 2]], 0.0, atol=1e-9)


@pytest.mark.parametrize("stiffness", [3.0, -2.0])
def test_a_spring_in_the_machine_holds_its_rest_where_the_offset_says(machine, stiffness) -> None:
    """The offset of a joint with a spring is the spring's, and told once."""
    fit = result((Extra(Kind.SPRING, 2), [stiffness]), offset={"joint_3": -0.9})
    told = besides(fit, machine, "torque")
    name, place, values = alone(told)
    assert (name, place) == ("parallel_spring", ("joint_3",))
    assert values["rest"] == pytest.approx(0.9 / stiffness)
    assert offsets(fit, machine) == []
    more = effort(machine, told) - effort(machine, [])
    np.testing.assert_allclose(more[:, 2], stiffness * SEEN.q[:, 2] - 0.9, atol=1e-9)


def test_a_delay_of_one_joint_delays_that_joint_alone(machine) -> None:
    told = besides(result((Extra(Kind.LATE, 1), [0.02])), machine, "torque")
    assert alone(told) == ("time_delay", ("joint_2",), {"delay": 0.02})
    late = effort(machine, told)
    np.testing.assert_allclose(late[:, [0, 2]], effort(machine, [])[:, [0, 2]], atol=1e-12)
    earlier = dynamics(machine, *motion(SEEN.time - 0.02))
    np.testing.assert_allclose(late[8:, 1], earlier[8:, 1], atol=1e-5)


@pytest.mark.parametrize(
    ("joint", "names"), [(EVERY, NAMES), (0, NAMES[:1])], ids=["of all", "of the only joint"]
)
def test_a_delay_of_every_joint_is_that_of_the_channels(machine, joint: int, names) -> None:
    told = besides(result((Extra(Kind.LATE, joint), [0.02]), names=names), machine, "torque")
    assert alone(told)[1] == ("effort channels",)
    earlier = dynamics(machine, *motion(SEEN.time - 0.02))
    np.testing.assert_allclose(effort(machine, told)[8:], earlier[8:], atol=1e-5)


def test_a_zero_in_the_machine_turns_its_bodies_back(machine) -> None:
    told = besides(result((Extra(Kind.ZERO, 1), [0.08])), machine, "torque")
    assert alone(told) == ("position_offset", ("joint_2",), {"angle": 0.08})
    true = dynamics(machine, SEEN.q - [0.0, 0.08, 0.0], SEEN.v, SEEN.a)
    np.testing.assert_allclose(effort(machine, told), true, atol=1e-9)


def test_a_scale_in_the_machine_is_that_of_the_column(machine) -> None:
    told = besides(result((Extra(Kind.GAIN, 1), [-0.25])), machine, "torque")
    place = (f"joint_2__{CHANNEL_COLUMNS['torque']}",)
    assert alone(told) == ("effort_gain", place, {"gain": 0.75})
    ratio = effort(machine, told) / effort(machine, [])
    np.testing.assert_allclose(ratio, np.tile([1.0, 0.75, 1.0], (len(SEEN), 1)), rtol=1e-9)


def test_a_sensors_zero_stands_behind_its_scale(machine) -> None:
    """Regression tells torques as they should be: 2 N*m are 1.5 on a sensor that reads 75 %."""
    fit = result((Extra(Kind.GAIN, 1), [-0.25]), offset={"joint_2": 2.0}, gain=(1.0, 0.75, 1.0))
    told = [*offsets(fit, machine), *besides(fit, machine, "torque")]
    np.testing.assert_allclose(
        effort(machine, told)[:, 1], 0.75 * (effort(machine, [])[:, 1] + 2.0), atol=1e-9
    )


@pytest.mark.parametrize("kind", [Kind.WIND, Kind.PLAY])
def test_a_link_that_lags_behind_its_motor_does_so_in_the_machine(machine, kind: Kind) -> None:
    """To first order the torque of the motion that the link then has."""
    size, seen = 1e-3, measurement(at_motor=True)
    told = besides(result((Extra(kind, 1), [size])), machine, "torque")
    name, place, values = alone(told)
    assert place == ("joint_2",)
    torque = dynamics(machine, SEEN.q, SEEN.v, SEEN.a)[:, 1]
    if kind is Kind.WIND:
        assert (name, values["stiffness"]) == ("joint_elasticity", pytest.approx(1 / size))
        lag = size * torque
    else:
        assert (name, values["width"]) == ("backlash", size)
        lag = 0.5 * size * np.sign(torque)
    rate = np.gradient(lag, SEEN.time) if kind is Kind.WIND else 0 * lag
    q, v, a = (x.copy() for x in (SEEN.q, SEEN.v, SEEN.a))
    q[:, 1] -= lag
    v[:, 1] -= rate
    a[:, 1] -= np.gradient(rate, SEEN.time)
    expected = dynamics(machine, q, v, a) - dynamics(machine, SEEN.q, SEEN.v, SEEN.a)
    more = effort(machine, told, seen) - effort(machine, [], seen)
    # Play changes sides over a torque, and is sharp here: rows where it does so are left out.
    ok = np.abs(torque) > 0.4 * np.abs(torque).max()
    ok[:6] = ok[-6:] = False
    far = np.abs(expected[ok]).max()
    assert far > 1e-4
    np.testing.assert_allclose(more[ok], expected[ok], atol=0.1 * far)


def test_levels_shares_and_rivals_are_handed_on(machine) -> None:
    rivals = (Extra(Kind.ZERO, 2), Extra(Kind.CURVE, 0))
    fit = result((Extra(Kind.SPRING, 2), [3.0]), level=Level.APPROXIMATE, rivals=rivals)
    (one,) = besides(fit, machine, "torque")
    found = one.found(4, "N*m")
    assert (found.level, found.share, found.order) == (APPROXIMATE, 0.97, 4)
    assert found.rivals == (("position_offset", ("joint_3",)),)
    assert found.reason
    (sure,) = besides(result((Extra(Kind.SPRING, 2), [3.0])), machine, "torque")
    assert sure.found(1, "N*m").level == CONFIRMED
    assert not sure.found(1, "N*m").reason


def test_what_has_no_name_is_told_in_words_and_in_no_model(machine) -> None:
    curve = (Extra(Kind.CURVE, 1), [0.1] * 7)
    drag = (Extra(Kind.DRAG, 2), [0.1] * 7)
    fit = result(curve, drag)
    assert besides(fit, machine, "torque") == []
    first, second = unnamed(fit)
    assert first.startswith("joint_2 has a torque over its position that is no spring")
    assert second.startswith("joint_3 has friction that changes with its position")
    assert unnamed(result(curve, level=Level.SUSPECTED)) == []


def test_a_scale_is_looked_for_in_torques_and_lag_where_the_encoder_sits_on_the_motor() -> None:
    """A current's scale is that of its motor's torque constant."""
    assert Kind.GAIN in kinds_of("torque", at_motor=False)
    assert Kind.GAIN not in kinds_of("current", at_motor=False)
    lag = {Kind.WIND, Kind.PLAY}
    assert lag <= kinds_of("torque", at_motor=True)
    assert not lag & kinds_of("torque", at_motor=False)
    assert names_of(frozenset({Kind.WIND, Kind.CURVE})) == {"joint_elasticity"}


def test_every_effect_told_can_be_written(machine) -> None:
    """Every parameter of the effect is there, inside its bounds, its interval around it."""
    from pipeline.effects.registry import effect_named

    each = [(Extra(k, 1, 9.0), [0.05, 0.02]) for k in Kind if Extra(k, 1).named]
    for told in besides(result(*each), machine, "torque"):
        bounds = {p.name: p for p in effect_named(told.effect).parameters}
        for p in told.members[0].parameters:
            assert p.low <= p.value <= p.high
            assert bounds[p.name].low <= p.value <= bounds[p.name].high
            assert bounds[p.name].unit == p.unit
        needed = {n for n, b in bounds.items() if not b.optional}
        assert needed <= set(told.members[0].values)


def test_a_delay_of_an_unknown_joint_is_refused(machine) -> None:
    from pipeline.effects.registry import effect_named
    from pipeline.logs.errors import ModelError

    with pytest.raises(ModelError, match="joint_9"):
        effect_named("time_delay").apply(machine, ("joint_9",), {"delay": 0.01})
