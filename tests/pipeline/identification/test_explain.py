"""Which explanation: a few effects where a robot file vouches for bodies, else everything."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipeline.identification import results as limits
from pipeline.identification.whole.errors import NotWholeError
from pipeline.identification.workflow import explain as module
from pipeline.identification.workflow.explain import Explanation, explain
from pipeline.logs.prepared.measurement import FIT, PROVE, Measurement


@dataclass(frozen=True)
class Naming:
    found: tuple[Any, ...] = ()
    notes: tuple[str, ...] = ()
    base: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Finding:
    effect: str
    order: int = 0


@dataclass(frozen=True)
class Where:
    measurements: tuple[Measurement, ...]


ROBOT = SimpleNamespace(floating=False)


def measured(channel: str = "torque", part: int = FIT) -> Measurement:
    n, zero = 40, np.zeros((40, 2))
    return Measurement(
        "made", np.arange(n) / 100, ("a", "b"), zero, zero, zero, (channel,), zero[..., None],
        np.array([[0.1], [0.2]]), np.ones((n, 2), np.bool_), np.full(n, part, np.int8),
        np.zeros(n, np.intp), (slice(0, n),),
    )  # fmt: skip


class Calls:
    """Explanations that were asked for, with their answers given beforehand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, few: float, rest: float) -> None:
        self.asked: list[str] = []
        self.excess = {"few": few, "all": rest, "rest": rest}
        self.refused = ""
        self.doubt = np.zeros(2)
        monkeypatch.setattr(module, "identify", self._identify)
        monkeypatch.setattr(module, "fit_whole", self._fit_whole)

    def _identify(self, model: Any, measurements: Any, **given: Any) -> SimpleNamespace:
        which = "few" if "most" in given else "rest" if "without" in given else "all"
        self.asked.append(which)
        assert given.get("most", limits.FEW) == limits.FEW
        excess = np.array([self.excess[which]])
        found = (Finding(which),)
        return SimpleNamespace(naming=Naming(found), enough=excess.max() < 5.0, excess=excess)

    def _fit_whole(self, model: Any, where: Any) -> SimpleNamespace:
        self.asked.append("whole")
        if self.refused:
            raise NotWholeError(self.refused)
        return SimpleNamespace(
            found=(Finding("body"), Finding("law")),
            model="fitted",
            result=SimpleNamespace(base=("base",)),
            decided=frozenset({"coulomb_friction"}),
            notes=("a curve has no name",),
            floor=np.array([0.3, np.nan]),
            doubt=lambda m: self.doubt,
        )

    def explain(self, robot: Any = None, log: Measurement | None = None) -> Explanation:
        given = SimpleNamespace(robot=robot, file=SimpleNamespace(edits=()), model="model")
        progress = SimpleNamespace(step=lambda text: None)
        return explain(given, Where((log or measured(),)), progress)  # type: ignore[arg-type]


def test_of_a_bare_urdf_the_whole_machine_is_fitted_however_little_a_few_effects_leave(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = Calls(monkeypatch, few=1.0, rest=1.0)
    told = calls.explain()
    assert calls.asked == ["whole", "rest"]
    assert [(f.effect, f.order) for f in told.naming.found] == [
        ("body", 1),
        ("law", 2),
        ("rest", 3),
    ]
    assert told.naming.notes == ("a curve has no name",)
    assert told.naming.base == ("base",)


def test_a_robot_file_whose_log_a_few_effects_explain_needs_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = Calls(monkeypatch, few=1.1, rest=1.0)
    told = calls.explain(ROBOT)
    assert calls.asked == ["few"]
    assert told.whole is None
    assert [f.effect for f in told.naming.found] == ["few"]


@pytest.mark.parametrize(("rest", "kept"), [(1.2, "rest"), (3.9, "few")])
def test_where_a_few_leave_more_than_noise_the_whole_machine_must_take_a_large_part(
    monkeypatch: pytest.MonkeyPatch, rest: float, kept: str
) -> None:
    calls = Calls(monkeypatch, few=4.0, rest=rest)
    told = calls.explain(ROBOT)
    assert calls.asked == ["few", "whole", "rest"]
    assert told.naming.found[-1].effect == kept


@pytest.mark.parametrize("robot", [None, ROBOT])
def test_a_machine_that_cannot_be_fitted_is_explained_by_effects_and_says_why(
    monkeypatch: pytest.MonkeyPatch, robot: Any
) -> None:
    calls = Calls(monkeypatch, few=4.0, rest=1.0)
    calls.refused = "its base floats"
    told = calls.explain(robot)
    assert calls.asked[-2:] == ["whole", "all"]
    assert told.naming.notes == ("the machine was not fitted as a whole: its base floats",)


def test_a_robot_on_its_feet_is_never_fitted_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = Calls(monkeypatch, few=1.0, rest=1.0)
    calls.explain(SimpleNamespace(floating=True))
    assert calls.asked == ["all"]


def test_the_floor_is_at_least_what_the_richest_model_leaves(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a joint that was held it stays what it was."""
    calls = Calls(monkeypatch, few=1.0, rest=1.0)
    (seen,) = calls.explain().where.measurements
    np.testing.assert_allclose(seen.noise[:, 0], [0.3, 0.2])


def test_in_a_motion_nothing_was_learnt_from_what_bodies_leave_open_counts_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = Calls(monkeypatch, few=1.0, rest=1.0)
    calls.doubt = np.array([0.4, np.nan])
    (seen,) = calls.explain(log=measured(part=PROVE)).where.measurements
    np.testing.assert_allclose(seen.noise[:, 0], [0.5, 0.2])
    (learnt,) = calls.explain(log=measured(part=FIT)).where.measurements
    np.testing.assert_allclose(learnt.noise[:, 0], [0.3, 0.2])


def test_a_floor_of_torques_is_none_of_currents(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = Calls(monkeypatch, few=1.0, rest=1.0)
    log = replace(measured("current"), noise=np.array([[0.01], [0.02]]))
    (seen,) = calls.explain(log=log).where.measurements
    np.testing.assert_allclose(seen.noise[:, 0], [0.01, 0.02])
