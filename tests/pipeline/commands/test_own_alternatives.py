"""The list of alternatives is data: added to, cut down or renamed, every verb runs on it."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from actuators.errors import LegwattError
from actuators.loading.build import CATALOG
from pipeline.commands.main import main
from tests.command_line import rows_of
from tests.compared import as_compared

PAPERS = ("ideal", "rotor", "reversible", "irreversible")


def _parts() -> tuple[str, dict[str, str]]:
    text = (CATALOG / "alternatives.toml").read_text(encoding="utf-8")
    head, *parts = re.split(r"(?m)^(?=\[[a-z]+\]$)", text)
    return head, dict(zip(PAPERS, parts, strict=True))


def _renamed(part: str, old: str, new: str) -> str:
    return part.replace(f"[{old}]", f"[{new}]").replace(f"[[{old}.", f"[[{new}.")


def _catalogue(kind: str, folder: Path) -> tuple[str, ...]:
    """Write a catalogue; returns its alternatives."""
    head, four = _parts()
    parts = {
        "fifth": {**four, "belt": _renamed(four["reversible"], "reversible", "belt")},
        "only_reversible": {"reversible": four["reversible"]},
        "renamed": {f"my_{n}": _renamed(p, n, f"my_{n}") for n, p in four.items()},
    }[kind]
    shutil.copytree(CATALOG, folder)
    (folder / "alternatives.toml").write_text(head + "".join(parts.values()), encoding="utf-8")
    return tuple(parts)


def _column(file: Path, name: str) -> list[str]:
    return [row[name] for row in rows_of(file)]


@pytest.mark.usefixtures("sketched")
@pytest.mark.parametrize("kind", ["fifth", "only_reversible", "renamed"])
def test_standing_walking_and_the_report_run_on_any_list_of_alternatives(
    root: Path, tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    names = _catalogue(kind, tmp_path / "actuators")
    reports = tmp_path / "reports"
    options = ["reports", "--robot", str(root / "urdf" / "hexapod.toml"), "--samples", "51"]
    assert main([*options, "--actuators", str(tmp_path / "actuators"), "--out", str(reports)]) == 0
    for table in ("standing_energy", "walking_energy"):
        told = dict.fromkeys(_column(reports / f"{table}.csv", "alternative"))
        assert tuple(told) == names
    ratios = _column(reports / "walking_energy.csv", "ratio_to_ideal")
    assert all(ratios) if "ideal" in names else not any(ratios)
    said = capsys.readouterr().out
    assert all((reports / f"stage_energy_{name}.svg").exists() for name in names)
    assert (reports / "index.html").exists()
    assert (reports / "omissions.csv").exists() == (kind == "fifth")
    assert ("the paper says nothing of 'belt'" in said) == (kind == "fifth")
    why = "not held against the paper: no actuator alternative is built as the paper's 'ideal'"
    assert (why in said) == (kind != "fifth")


def test_a_log_of_a_machine_whose_actuator_nobody_names_asks_for_it(
    root: Path, tmp_path: Path
) -> None:
    _catalogue("only_reversible", tmp_path / "actuators")
    log = root / "pipeline" / "identification" / "demo" / "walk.parquet"
    robot = root / "urdf" / "hexapod.toml"
    with pytest.raises(LegwattError, match=r"no alternative 'rotor' .* alternative: 'reversible'$"):
        as_compared(log, robot=robot, actuators=tmp_path / "actuators")
