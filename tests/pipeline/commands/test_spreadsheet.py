"""LibreOffice Calc opens every CSV of a run with its numbers as numbers, in both settings."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.command_line import Command, exit_code, rows_of
from tests.demo import DEMO

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("soffice") is None, reason="LibreOffice (soffice) is not installed"
    ),
]
NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?([eE][-+]?[0-9]+)?")
#: decimal: separator as a character code, language of the import (en-US, de-DE)
SETTINGS = {"dot": (44, 1033), "comma": (59, 1031)}


#: Of Calc's export: fields by commas, texts in quotation marks, numbers without.
FIELD = re.compile(r'(?:^|,)(?:"((?:[^"]|"")*)"|([^",]*))')


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory, command: Command) -> Path:
    """Tables of the robot, of what is held against the paper, and of a log, in both settings."""
    top = tmp_path_factory.mktemp("both")
    for decimal in SETTINGS:
        folder, more = top / decimal, ("--decimal", decimal)
        assert command("reports", folder / "reports", *more) == 0
        assert exit_code(["gap", "where", str(DEMO), *more, "--out", str(folder / "gap")]) == 0
        for path in folder.glob("*/*.csv"):
            path.rename(folder / path.name)
    return top


@pytest.mark.parametrize("decimal", SETTINGS)
def test_calc_reads_every_table(both: Path, tmp_path: Path, decimal: str) -> None:
    """Import as a person's spreadsheet would, export anew in plain form, compare every cell.

    What is a number in the plain file, be it in a column of texts, is one in Calc, too.
    """
    separator, language = SETTINGS[decimal]
    names = sorted(p.stem for p in (both / decimal).glob("*.csv"))
    assert {"standing", "walking_losses", "conclusions", "where"} <= set(names)
    assert len(names) >= 24
    inputs = [both / decimal / f"{name}.csv" for name in names]
    subprocess.run(
        [
            "soffice",
            f"-env:UserInstallation=file://{tmp_path}/profile",
            "--headless",
            # Detect special numbers is off: what is no plain number in that language stays text.
            f"--infilter=CSV:{separator},34,UTF-8,1,,{language},false,false",
            "--convert-to",
            "csv:Text - txt - csv (StarCalc):44,34,76,1,,1033,true,false",
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
        rows = rows_of(both / "dot" / f"{name}.csv")
        back = (tmp_path / "back" / path.name).read_text(encoding="utf-8").splitlines()
        header, *lines = [list(FIELD.finditer(line)) for line in back]
        assert [cell[1] for cell in header] == list(rows[0]), name
        assert len(lines) == len(rows), name
        for row, cells in zip(rows, lines, strict=True):
            for (column, value), cell in zip(row.items(), cells, strict=True):
                text, number = cell[1], cell[2]
                if NUMBER.fullmatch(value):
                    assert text is None, f"{name}, {column}: {value} is a text in Calc"
                    assert float(number) == pytest.approx(float(value), rel=1e-14), (name, column)
                    numbers += 1
                elif value in ("true", "false"):
                    assert text in (None, value)
                    assert text or number in (value.upper(), "1" if value == "true" else "0")
                else:
                    assert (text or number or "").replace('""', '"') == value, (name, column)
    assert numbers > 100_000
