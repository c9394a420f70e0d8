"""The list of rooms that `make mutants` reads is true of the tree, and faults are real ones."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

from tests import mutants

CONFIG = tomllib.loads(mutants.CONFIG.read_text(encoding="utf-8"))


@pytest.mark.parametrize("room", CONFIG["room"], ids=lambda r: r["name"])
def test_every_glob_of_a_room_matches_files(room: dict[str, list[str]], root: Path) -> None:
    for key in ("sources", "tests"):
        for pattern in room[key]:
            assert list(root.glob(pattern)), f"{mutants.CONFIG.name}: {pattern} matches no file"


def test_what_is_named_equivalent_still_stands_in_its_file(root: Path) -> None:
    stands = {
        (path.name, line.strip())
        for room in CONFIG["room"]
        for glob in room["sources"]
        for path in root.glob(glob)
        for line in path.read_text(encoding="utf-8").splitlines()
    }
    for known in CONFIG.get("equivalent", []):
        assert (known["file"], known["was"]) in stands
        assert known["was"] != known["now"]
        assert known["why"]


def test_a_line_belongs_to_its_statement_and_a_head_to_itself() -> None:
    text = "x = (\n    1\n    + 2\n)\nif (\n    x\n):\n    y = 3\n"
    spans = mutants.statements(ast.parse(text))
    assert [spans[line] for line in (1, 3, 4)] == [(1, 4)] * 3
    assert spans[6] == (5, 7)
    assert spans[8] == (8, 8)


def test_faults_are_valid_and_mean_something_else(tmp_path: Path) -> None:
    pytest.importorskip("cosmic_ray")
    text = (
        "from functools import cache\n@cache\ndef f(a, *, b=2.0):\n"
        '    """Two 2."""\n    return a - b if a >= b and not a == 7 else -a\n'
    )
    (tmp_path / "f.py").write_text(text, encoding="utf-8")
    reached = {"slow.py": {"f.py": {3, 5}}, "quick.py": {"f.py": {5}}}
    made = list(mutants.mutants_of(tmp_path, "f.py", reached, {"slow.py": 2.0, "quick.py": 1.0}))
    now = {m.now for m in made}
    assert "return a + b if a >= b and not a == 7 else -a" in now
    assert "return a - b if a > b and not a == 7 else -a" in now
    assert "return a - b if a >= b or not a == 7 else -a" in now
    assert "return a - b if a >= b and not a == 7 else +a" in now
    for mutant in made:
        assert ast.dump(ast.parse(mutant.source)) != ast.dump(ast.parse(text))
        assert mutant.tests == (("quick.py", "slow.py") if mutant.line == 5 else ("slow.py",))
