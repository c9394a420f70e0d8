"""Parts that can be bought: every row loads, none contradicts itself, wrong ones say where."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from actuators.errors import LegwattError
from actuators.loading.data_sheet import KINDS
from actuators.loading.parts import PARTS, Part, load_parts, odd


def own_motor(folder: Path, kind: str = "motor", **changes: str) -> Path:
    """A folder with the maxon RE 40 alone and other cells; None takes a column out."""
    with (PARTS / "motor.csv").open(encoding="utf-8", newline="") as file:
        row = next(r for r in csv.DictReader(file) if r["name"] == "maxon_148867")
    row = {k: v for k, v in (row | changes).items() if v is not None}
    with (folder / f"{kind}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, row)
        writer.writeheader()
        writer.writerow(row)
    return folder


def loaded(folder: Path) -> Part:
    return load_parts(folder)["maxon_148867"]


def test_no_part_contradicts_itself_and_each_says_where_its_numbers_are_from() -> None:
    parts = load_parts()
    assert len(parts) == 178
    assert [line for p in parts.values() for line in odd(p)] == []
    assert all(len(p.source) > 10 and p.title for p in parts.values())
    assert {p.kind for p in parts.values()} == set(KINDS)
    assert all(p.note for p in parts.values() if p.filled)
    assert parts["maxon_148867"].filled == ("coulomb_share", "peak_current")
    assert parts["moteus_r4_11"].bases == {"on_resistance": "derived"}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"curent_of": "dc"}, "motor.csv: unknown column 'curent_of': did you mean 'current_of'"),
        ({"resistance_V": "0.3"}, "resistance: '0.3 V': expected a resistance"),
        ({"resistance_om": "0.3"}, "column 'resistance_om': unknown unit 'om': did you mean 'ohm'"),
        ({"resistance_ohm": "-0.3"}, r"line 2 \(maxon_148867\): .* expected more than 0"),
        ({"basis": "datashet"}, "line 2: 'basis': 'datashet': did you mean 'datasheet'"),
        ({"peak_current_low_A": ""}, "peak_current: a range needs both columns"),
        ({"peak_current_A": "30"}, "peak_current: 30 A lies outside its range 12 to 24 A"),
    ],
)
def test_a_wrong_row_is_one_line(tmp_path: Path, changes: dict[str, str], says: str) -> None:
    with pytest.raises(LegwattError, match=says) as refused:
        loaded(own_motor(tmp_path, **changes))
    assert "\n" not in str(refused.value)


def test_folders(tmp_path: Path) -> None:
    for folder, says in ((tmp_path / "none", "no such folder"), (tmp_path, "no parts")):
        with pytest.raises(LegwattError, match=says):
            load_parts(folder)
    path = own_motor(tmp_path) / "motor.csv"
    text = path.read_text("utf-8")
    path.write_text(text + text.splitlines()[1] + "\n", "utf-8")
    with pytest.raises(LegwattError, match="motor.csv: maxon_148867: another part has this name"):
        load_parts(tmp_path)
