"""LibreOffice Calc opens every CSV of a run with the right numbers, in both decimal settings."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.app.conftest import Command, rows_of

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("soffice") is None, reason="LibreOffice (soffice) is not installed"
    ),
]
#: decimal: ending, separator as a character code, language of the import (en-US, de-DE)
SETTINGS = {"dot": (".csv", 44, 1033), "comma": (".comma.csv", 59, 1031)}


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory, command: Command) -> Path:
    folder = tmp_path_factory.mktemp("both")
    assert command("stand", folder, "--decimal", "comma") == 0
    assert command("walk", folder, "--decimal", "comma") == 0
    return folder


@pytest.mark.parametrize("decimal", SETTINGS)
def test_calc_reads_every_table(both: Path, tmp_path: Path, decimal: str) -> None:
    """Import as a person's spreadsheet would, export anew in plain form, compare every cell."""
    ending, separator, language = SETTINGS[decimal]
    names = sorted(p.name.removesuffix(".meta.json") for p in both.glob("*.meta.json"))
    assert len(names) >= 14
    inputs = [both / f"{name}{ending}" for name in names]
    subprocess.run(
        [
            "soffice",
            f"-env:UserInstallation=file://{tmp_path}/profile",
            "--headless",
            # Detect special numbers is off: what is no plain number in that language stays text.
            f"--infilter=CSV:{separator},34,UTF-8,1,,{language},false,false",
            "--convert-to",
            "csv:Text - txt - csv (StarCalc):44,34,76,1,,1033,false,false",
            "--outdir",
            str(tmp_path / "back"),
            *map(str, inputs),
        ],
        check=True,
        capture_output=True,
        timeout=300,
    )
    numbers = 0
    for name, path in zip(names, inputs, strict=True):
        rows, back = rows_of(both / f"{name}.csv"), rows_of(tmp_path / "back" / path.name)
        assert len(rows) == len(back), name
        for row, cells in zip(rows, back, strict=True):
            assert list(row) == list(cells), name
            for column, value in row.items():
                cell = cells[column]
                if cell == value:
                    continue
                if value in ("true", "false"):
                    assert cell in (value.upper(), "1" if value == "true" else "0"), (name, column)
                    continue
                assert float(cell) == pytest.approx(float(value), rel=1e-14), (name, column)
                numbers += 1
    assert numbers > 10_000
