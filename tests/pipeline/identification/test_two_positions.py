"""Elasticity and play of a joint whose log holds both positions."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.identification import two_positions
from pipeline.identification.results import CONFIRMED, Found
from pipeline.identification.two_positions import READ_OFF, read_off_two
from pipeline.logs.prepared.measurement import TEST, TRAIN, VALIDATION

N = 6000
STIFF, WIDTH = 800.0, 0.004


@dataclass
class Made:
    """A prepared log, as far as two positions are concerned."""

    q: NDArray[np.float64]
    v: NDArray[np.float64]
    a: NDArray[np.float64]
    effort: NDArray[np.float64]
    mask: NDArray[np.bool_]
    other: dict[str, NDArray[np.float64]]
    time: NDArray[np.float64]
    joints: tuple[str, ...] = ("a", "b")
    friction: NDArray[np.float64] = field(default_factory=lambda: np.zeros((N, 2)))
    channel: str = "torque"
    noise: NDArray[np.float64] = field(default_factory=lambda: np.full(2, 0.01))
    log: Any = field(default_factory=lambda: SimpleNamespace(position_source="joint"))
    fusion: Any = field(default_factory=lambda: SimpleNamespace(noise=np.full((3, 2), 1e-6)))

    def lowpass(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return x


def made(
    stiff: float = np.inf, width: float = 0.0, spoilt: slice = slice(0, 0), rubs: float = 0.0
) -> Made:
    """Joint a is wound and plays; motor and joint b agree. Rows that are spoilt say nonsense."""
    t = np.arange(N) / 200.0
    rng = np.random.default_rng(0)
    q = np.column_stack([np.sin(1.3 * t), 0.5 * np.sin(0.9 * t)])
    v = np.column_stack([1.3 * np.cos(1.3 * t), 0.45 * np.cos(0.9 * t)])
    torque = np.column_stack([6.0 * np.sin(2.1 * t), 4.0 * np.cos(1.7 * t)])
    friction = rubs * np.abs(torque) * np.sign(v)
    motor = q + 2e-5 * rng.standard_normal(q.shape)
    motor[:, 0] += torque[:, 0] / stiff + 0.5 * width * np.sign(torque[:, 0])
    motor[spoilt, 0] += torque[spoilt, 0] / 50.0
    mask = np.ones((N, 2), np.bool_)
    return Made(
        q,
        v,
        np.zeros_like(q),
        torque + friction,
        mask,
        {"motor_position": motor},
        t,
        friction=friction,
    )


@pytest.fixture(autouse=True)
def _friction_of_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model's friction is what the log was made with: a log is its own measurement here."""

    class Rubbing:
        def __init__(self, log: Made) -> None:
            self.log = log

        def predict(self, model: Any) -> SimpleNamespace:
            return SimpleNamespace(
                effort=self.log.friction[:, :, None], torque=np.zeros_like(self.log.friction)
            )

    monkeypatch.setattr(two_positions, "Simulator", Rubbing)


def told(*logs: Made, part: NDArray[np.int8] | None = None) -> tuple[Found, ...]:
    parts = np.full(N, TRAIN, np.int8) if part is None else part
    split = SimpleNamespace(part=(parts,) * len(logs))
    return read_off_two(None, logs, split, logs, first=3)  # type: ignore[arg-type]


def estimates(found: Found) -> dict[str, tuple[float, float, float]]:
    return {p.name: (p.low, p.value, p.high) for p in found.parameters}


def test_a_transmission_that_winds_up_is_elastic_with_its_stiffness_in_the_interval() -> None:
    (one,) = told(made(stiff=STIFF))
    assert (one.order, one.effect, one.law, one.place) == (3, "joint_elasticity", READ_OFF, ("a",))
    low, value, high = estimates(one)["stiffness"]
    assert low < value < high
    assert value == pytest.approx(STIFF, rel=0.02)
    assert one.level == CONFIRMED


@pytest.mark.parametrize(("stiff", "stiffness"), [(np.inf, 1e12), (STIFF, STIFF)])
def test_play_is_told_with_its_width_and_elasticity_with_it(stiff: float, stiffness: float) -> None:
    (one,) = told(made(stiff=stiff, width=WIDTH))
    assert (one.effect, one.place) == ("backlash", ("a",))
    values = estimates(one)
    assert values["width"][1] == pytest.approx(WIDTH, rel=0.05)
    assert values["width"][0] <= values["width"][1] <= values["width"][2]
    assert values["stiffness"][1] == pytest.approx(stiffness, rel=0.05)
    assert 0.0 < values["crossing"][1] < 6.0


def test_where_nothing_winds_up_or_nothing_can_tell_there_is_no_finding() -> None:
    assert told(made()) == ()
    only_proves = np.full(N, TEST, np.int8)
    assert told(made(stiff=STIFF), part=only_proves) == ()
    current = made(stiff=STIFF)
    current.channel = "current"
    assert told(current) == ()


def test_friction_before_the_spring_winds_nothing_up() -> None:
    log = made(stiff=STIFF, rubs=0.2)
    (one,) = told(log)
    low, value, high = estimates(one)["stiffness"]
    assert value == pytest.approx(STIFF, rel=0.01)
    # How far friction is from its law nobody knows: half of what it changes is in the interval.
    log.friction = np.zeros((N, 2))
    (plain,) = told(log)
    changed = abs(estimates(plain)["stiffness"][1] - value)
    assert changed > 0.01 * STIFF
    assert high - low > 0.9 * changed


def test_rows_that_prove_are_not_looked_at() -> None:
    part = np.full(N, VALIDATION, np.int8)
    part[N // 2 :] = TEST
    straight, spoilt = (
        told(made(stiff=STIFF, spoilt=s), part=part) for s in (slice(0, 0), slice(N // 2, N))
    )
    assert [estimates(f) for f in straight] == [estimates(f) for f in spoilt]
    # The same rows would have had a say, had they not been held out.
    (other,) = told(made(stiff=STIFF, spoilt=slice(N // 2, N)))
    assert estimates(other)["stiffness"][1] < 0.5 * STIFF
