"""What naming finds, written to a model file and read back, is the machine that was found."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.effects.base import Effect, Place
from pipeline.effects.bodies import LinkMass
from pipeline.effects.curves import FrictionCurveEffect, PositionCurveEffect
from pipeline.effects.model_file import apply_edits, new_model_file, read_model_file
from pipeline.effects.motor import SensedHeating
from pipeline.effects.registry import EFFECTS, catalogue
from pipeline.effects.transmission import BareCoupling
from pipeline.identification.results import Estimate, Found
from pipeline.identification.workflow.model_writer import edits_of, model_text
from pipeline.logs.errors import ModelFileError
from pipeline.machine.machine import MachineModel
from pipeline.simulation.files import base_model

FORMS = (*(e for e in EFFECTS.values() if e.competes), BareCoupling(), SensedHeating())
EVERY = (*EFFECTS.values(), BareCoupling(), SensedHeating())
#: Places of the leg, by kind.
PLACES: Mapping[str, Place] = {
    "joint": ("rm_joint_2",),
    "joint pair": ("rm_joint_2", "rm_joint_3"),
    "link": ("rm_femur_link",),
    "ground": ("ground",),
    "effort channels": ("effort channels",),
    "effort column": ("rm_joint_2__current_A",),
}
#: Nonlinear parameters, which `shapes` would take from a log.
SHAPES: Mapping[type[Effect], Mapping[str, float]] = {
    type(EFFECTS["stribeck_friction"]): {"velocity": 0.05},
    type(EFFECTS["backlash"]): {"crossing": 0.7},
    type(EFFECTS["torque_ripple"]): {"order": 100.0},
    type(EFFECTS["winding_heating"]): {"time_constant": 4.0},
    type(EFFECTS["warming_friction"]): {"reference": 300.0},
    SensedHeating: {"time_constant": 10.0},
    BareCoupling: {"ratio": -1.0},
    LinkMass: {"x": 0.1, "y": -0.02, "z": 0.3},
    FrictionCurveEffect: {
        **{f"speed_{k}": 0.5 * (k - 1) for k in range(1, 6)},
        **{f"place_{k}": 0.1 * (k - 4) for k in range(1, 8)},
        "travel": 0.02,
    },
    PositionCurveEffect: {f"place_{k}": 0.1 * (k - 5) for k in range(1, 10)},
}


def _form(effect: Effect) -> str:
    return type(effect).__name__


def _estimates(effect: Effect, values: Mapping[str, float], channel: str) -> tuple[Estimate, ...]:
    return tuple(
        Estimate(n, v, v - 0.1 * abs(v), v + 0.1 * abs(v), unit=effect.unit(n, channel))
        for n, v in values.items()
    )


def _found(effect: Effect, place: Place, values: Mapping[str, float], channel: str) -> Found:
    nan = float("nan")
    return Found(
        order=1,
        effect=effect.name,
        place=place,
        parameters=_estimates(effect, values, channel),
        rivals=(),
        valid_before=nan,
        valid_after=nan,
        unit="A",
        noise_floor=nan,
        excitation=effect.excitation,
    )


def _leaves(thing: Any, where: str = "") -> Iterator[tuple[str, Any]]:
    """Everything a machine is made of, by where it stands."""
    if dataclasses.is_dataclass(thing):
        yield f"{where}()", type(thing).__name__
        for f in dataclasses.fields(thing):
            yield from _leaves(getattr(thing, f.name), f"{where}.{f.name}")
    elif isinstance(thing, Mapping):
        for key, value in thing.items():
            yield from _leaves(value, f"{where}[{key}]")
    elif isinstance(thing, tuple):
        for k, value in enumerate(thing):
            yield from _leaves(value, f"{where}[{k}]")
    else:
        yield where, thing


def _parts(model: MachineModel) -> dict[str, Any]:
    return dict(_leaves((model.bodies, model.actuators)))


def same(one: MachineModel, other: MachineModel) -> bool:
    """Whether two machines are made of the same parts with the same numbers."""
    a, b = _parts(one), _parts(other)
    if a.keys() != b.keys():
        return False
    for where, value in a.items():
        if isinstance(value, float | np.ndarray):
            if not np.allclose(value, b[where], rtol=1e-9, atol=0.0, equal_nan=True):
                return False
        elif value != b[where]:
            return False
    return True


def _coordinates(effect: Effect, size: float) -> dict[str, float]:
    """Estimates that differ from one another; negative where that makes sense and is asked."""
    return {
        c.name: (1.0 if c.signed or size > 0 else -1.0) * size * (k + 1) * c.step
        for k, c in enumerate(effect.coordinates)
    }


@pytest.mark.parametrize("size", [7.0, -7.0])
@pytest.mark.parametrize("channel", ["current", "voltage"])
@pytest.mark.parametrize("effect", FORMS, ids=_form)
def test_what_is_found_is_read_back_as_the_same_machine(
    tmp_path: Path, root: Path, effect: Effect, channel: str, size: float
) -> None:
    bare = isinstance(effect, BareCoupling)
    file = new_model_file(root / "urdf" / "leg.toml", "" if bare else "rotor")
    base, place = base_model(file), PLACES[effect.place_kind]
    x, shape = _coordinates(effect, size), dict(SHAPES.get(type(effect), {}))
    found = effect.edit(base, place, x, shape)
    assert not same(found, base)
    edits = edits_of(
        [_found(effect, place, effect.physical(x, shape), channel)], source="log.csv, SHA-256 00"
    )
    path = tmp_path / "model.toml"
    path.write_text(model_text(file.with_edits(edits), tmp_path), encoding="utf-8")
    back = read_model_file(path)
    assert [e.values for e in back.edits] == [e.values for e in edits]
    assert same(apply_edits(base_model(back), back.edits), found)
    # Written once more it is the same file: a model that is added to keeps what it had.
    assert model_text(back, tmp_path) == path.read_text(encoding="utf-8")


@pytest.mark.parametrize("alternative", ["", "rotor"])
def test_every_form_that_competes_is_tried_above(root: Path, alternative: str) -> None:
    model = base_model(new_model_file(root / "urdf" / "leg.toml", alternative))
    assert {type(e) for e in catalogue(model)} <= {type(e) for e in FORMS}


@pytest.mark.parametrize("effect", EVERY, ids=_form)
def test_an_estimate_at_its_bound_is_read_back(tmp_path: Path, root: Path, effect: Effect) -> None:
    """Whatever is plausible lies in the reader's bounds, the bounds themselves among it."""
    file = new_model_file(root / "urdf" / "leg.toml", "rotor")
    for end in ("low", "high"):
        values = {p.name: float(getattr(p, end)) for p in effect.parameters}
        edits = edits_of(
            [_found(effect, PLACES[effect.place_kind], values, "current")], source="log.csv"
        )
        path = tmp_path / f"{end}.toml"
        path.write_text(model_text(file.with_edits(edits), tmp_path), encoding="utf-8")
        assert [e.values for e in read_model_file(path).edits] == [values]


def test_a_parameter_that_may_be_left_out_may_and_another_may_not(
    tmp_path: Path, root: Path
) -> None:
    file = new_model_file(root / "urdf" / "leg.toml", "rotor")
    effect, path = EFFECTS["winding_heating"], tmp_path / "model.toml"
    every = {"rise": 3.0, "thermal_resistance": 2.0, "time_constant": 4.0, "sensor_gain": 0.5}
    for left in every:
        values = {n: v for n, v in every.items() if n != left}
        edits = edits_of([_found(effect, ("rm_joint_2",), values, "current")], source="log.csv")
        path.write_text(model_text(file.with_edits(edits), tmp_path), encoding="utf-8")
        if left == "sensor_gain":
            assert read_model_file(path).edits[0].values == values
        else:
            with pytest.raises(ModelFileError, match=f"needs the parameter '{left}'"):
                read_model_file(path)


def test_the_level_of_a_finding_is_written_and_read_back(tmp_path: Path, root: Path) -> None:
    file = new_model_file(root / "urdf" / "leg.toml", "rotor")
    friction, path = EFFECTS["coulomb_friction"], tmp_path / "model.toml"
    found = _found(friction, ("rm_joint_2",), {"torque": 0.3}, "current")
    found = dataclasses.replace(found, level="approximate")
    path.write_text(
        model_text(file.with_edits(edits_of([found], source="log")), tmp_path), encoding="utf-8"
    )
    (edit,) = read_model_file(path).edits
    assert edit.level == "approximate"
    text = path.read_text(encoding="utf-8").replace('"approximate"', '"doubtful"')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ModelFileError, match=r"edit 1\.level"):
        read_model_file(path)
