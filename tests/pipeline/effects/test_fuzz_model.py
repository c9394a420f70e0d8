"""Whatever the bytes of a model file: a clear line or a model, never a traceback."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from actuators.errors import ActuatorError
from pipeline.effects.base import Effect
from pipeline.effects.model_file import (
    Edit,
    EditParameter,
    apply_edits,
    new_model_file,
    read_model_file,
)
from pipeline.effects.registry import EFFECTS
from pipeline.errors import PipelineError
from pipeline.identification.workflow.model_writer import model_text
from pipeline.logs.errors import GapError
from pipeline.machine.machine import MachineModel
from pipeline.simulation.files import base_model
from tests.pipeline.logs.test_fuzz_readers import TOML_TOKENS, mutated

#: Places on the leg by kind of place; what acts on other things is not on a leg.
PLACES = {"joint": ("rm_joint_2",), "link": ("rm_tibia_link",)}
VALUES = (
    *('"N*m"', '"kg"', '"xyz"', '""', "0", "1", "-1", "2.5", "1e20", "-1e308", "1e308", "nan"),
    *("inf", "-inf", "true", "[]", '["rm_joint_1"]', '["rm_joint_1", "rm_joint_1"]', '["x"]', "{}"),
    *("[0, 1]", "[1, 0]", "[0]", "[nan, inf]", "2020-01-01", '"coulomb_friction"', '"backlash"'),
    *('"base_tilt"', '"transmission_coupling"', '"identified"', '["rm_tibia_link"]', "99" * 200),
)
TABLES = ("[[edit]]", "[edit]", "[robot]", "[actuators]", "[edit.parameters.mass]", "[x]", "[[x]]")


@pytest.fixture(scope="module")
def bare(root: Path) -> MachineModel:
    return base_model(new_model_file(root / "urdf" / "leg.toml", "rotor"))


#: Values in the middle of what can be where those of others decide what can: knots ascend from
#: none, and a body's inertia has the room that its first moments need.
MIDDLE = {f"speed_{k}": 0.5 * (k - 1) for k in range(1, 6)}
MIDDLE |= {f"place_{k}": 0.1 * (k - 5) for k in range(1, 10)}
MIDDLE |= {"mass": 2.0, "mx": 0.1, "my": 0.1, "mz": 0.1, "Ixy": 0.0, "Ixz": 0.0, "Iyz": 0.0}


def _parameters(effect: Effect) -> tuple[EditParameter, ...]:
    """Values in the middle of what can be."""
    out = []
    for p in effect.parameters:
        if p.name in MIDDLE:
            out.append(EditParameter(p.name, MIDDLE[p.name], p.unit, (MIDDLE[p.name],) * 2))
            continue
        value = 0.1 if p.low < 0.1 < p.high else 0.5 * (p.low + min(p.high, 100.0))
        low, high = sorted((0.9 * value, 1.1 * value))
        unit = "A" if p.unit == "channel" else p.unit
        out.append(EditParameter(p.name, value, unit, (low, high)))
    return tuple(out)


@pytest.fixture(scope="module")
def text(root: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    edits = [
        Edit(name, PLACES[effect.place_kind], _parameters(effect), source="log.csv, SHA-256 00")
        for name, effect in EFFECTS.items()
        if effect.place_kind in PLACES
    ]
    assert len(edits) > 10
    file = new_model_file(root / "urdf" / "leg.toml", "rotor").with_edits(edits)
    return model_text(file, tmp_path_factory.mktemp("model")).encode()


def respelt(text: bytes, rng: np.random.Generator) -> bytes:
    """Well-formed TOML, mostly, with other values, lines and tables."""
    lines = text.decode().splitlines()
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        if "=" in lines[at] and rng.integers(4):
            lines[at] = f"{lines[at].split('=')[0]}= {VALUES[int(rng.integers(len(VALUES)))]}"
        elif rng.integers(2):
            del lines[at]
        else:
            lines.insert(at, TABLES[int(rng.integers(len(TABLES)))])
    return "\n".join(lines).encode()


def check(path: Path, bare: MachineModel) -> str:
    """Read and apply. Returns why the file was refused; nothing where it was accepted."""
    try:
        model = apply_edits(bare, read_model_file(path).edits)
    except (GapError, ActuatorError, PipelineError) as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 700, message
        return message
    assert model.joints == bare.joints
    assert np.isfinite([a.effort_offset for a in model.actuators]).all()
    return ""


def fuzz(text: bytes, bare: MachineModel, folder: Path, count: int, seed: int) -> int:
    rng = np.random.default_rng(seed)
    bad = folder / "bad.toml"
    accepted = 0
    for _ in range(count):
        rough = bool(rng.integers(3) == 0)
        bad.write_bytes(mutated(text, rng, TOML_TOKENS) if rough else respelt(text, rng))
        accepted += check(bad, bare) == ""
    return accepted


def test_the_unmutated_file_is_accepted(text: bytes, bare: MachineModel, tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_bytes(text)
    assert check(tmp_path / "model.toml", bare) == ""


def test_five_hundred_files(text: bytes, bare: MachineModel, tmp_path: Path) -> None:
    accepted = fuzz(text, bare, tmp_path, 500, seed=1)
    assert 10 < accepted < 400  # most mutations must matter, and not all be the same


@pytest.mark.slow
def test_ten_thousand_files(text: bytes, bare: MachineModel, tmp_path: Path) -> None:
    fuzz(text, bare, tmp_path, 10_000, seed=2)
