"""Parts that can be bought: every file loads, none contradicts itself, wrong ones say where."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuators.errors import LegwattError
from actuators.loading.parts import KINDS, PARTS, load_part, load_parts, odd

TEXT = (PARTS / "motor" / "maxon_148867.toml").read_text("utf-8")


def written(folder: Path, old: str = "", new: str = "", kind: str = "motor") -> Path:
    (folder / kind).mkdir()
    path = folder / kind / "own.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new), "utf-8")
    return path


def test_no_part_contradicts_itself_and_each_says_where_its_numbers_are_from() -> None:
    parts = load_parts()
    assert [line for p in parts.values() for line in odd(p)] == []
    assert all(len(p.source) > 10 and p.title for p in parts.values())
    assert {p.kind for p in parts.values()} == set(KINDS)
    assert all(p.note for p in parts.values() if p.filled)
    assert parts["maxon_148867"].filled == ("coulomb_share", "peak_current")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("current_of", "curent_of", "no entry 'curent_of': did you mean 'current_of'"),
        ('"0.299 ohm"', '"0.3 V"', r"motor/own.toml: --resistance: '0.3 V'"),
        ('"0.299 ohm"', '"-0.3 ohm"', "expected more than 0"),
        ('"datasheet"', '"sheet"', "basis"),
        ("[printed]", "[printd]", "printed"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    with pytest.raises(LegwattError, match=says) as refused:
        load_part(written(tmp_path, old, new))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("317 rpm/V", "100 rpm/V", "--speed-constant"),
        ('"12 to 24 A"', '"2 A"', "peak current or torque is below"),
        ('peak_current = "12 to 24 A"\n', "", "missing: --peak-current or --peak-torque"),
    ],
)
def test_a_contradiction_is_said(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert says in " ".join(odd(load_part(written(tmp_path, old, new))))


def test_folders(tmp_path: Path) -> None:
    for folder, says in ((tmp_path / "none", "no such folder"), (tmp_path, "no parts")):
        with pytest.raises(LegwattError, match=says):
            load_parts(folder)
    written(tmp_path, kind="moter")
    with pytest.raises(LegwattError, match="unknown kind 'moter': did you mean 'motor'"):
        load_parts(tmp_path)
