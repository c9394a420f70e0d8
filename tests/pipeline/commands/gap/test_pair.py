"""Two logs of one machine: what the first lacks goes into the model, the second has a payload."""

from pathlib import Path

import pytest

from tests.blind.machines.trial import make
from tests.command_line import exit_code, rows_of

SEED = 5  # of the machine: its tolerances, its motion and what is hidden


def _machine(out: Path, *hidden: str) -> dict[str, dict[str, float]]:
    truth = make("own", SEED, 0, out, machine="leg", effects=hidden)
    return {item["effect"]: item["values"] for item in truth["hidden"]}


def _gap(step: str, folder: Path, out: Path, *more: str) -> list[dict[str, str]]:
    given = folder / "given"
    files = [str(given / "log.csv"), "--robot", str(given / "machine.urdf")]
    mapping = ["--mapping", str(given / "mapping.toml")]
    assert exit_code(["gap", step, *files, *mapping, "--out", str(out), *more]) in (0, 1)
    return rows_of(out / "found.csv") if (out / "found.csv").exists() else []


@pytest.mark.slow
def test_a_payload_is_weighed_once_the_friction_is_in_the_model(tmp_path: Path) -> None:
    bare, loaded = tmp_path / "bare", tmp_path / "loaded"
    _machine(bare)
    truth = _machine(loaded, "link_mass")
    _gap("add", bare, tmp_path / "first")
    model = tmp_path / "first" / "model.toml"
    found = _gap("name", loaded, tmp_path / "second", "--model", str(model))
    (mass,) = [r for r in found if (r["effect"], r["parameter"]) == ("link_mass", "mass")]
    assert mass["place"] == "link_3"
    assert float(mass["value"]) == pytest.approx(truth["link_mass"]["mass"], rel=0.15)
