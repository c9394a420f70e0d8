"""The rooms import only what the design lets them import."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Units, parameters and their errors use the standard library only; every room may read them.
LEAVES = {"actuators.units", "actuators.parameters", "actuators.errors", "actuators.text_file"}
ROOMS = {"actuators", "pipeline", "reports"}


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module


def room_of(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    if parts[0] != "pipeline":
        return parts[0]
    if len(parts) > 2 and parts[1] == "gap":
        return "twin" if parts[2] == "twin" else "gap"
    if len(parts) > 2 and parts[1] in ("app", "calibration"):
        return parts[1]
    return "core"


FILES = [
    path
    for room in sorted(ROOMS)
    for path in sorted((ROOT / room).rglob("*.py"))
    if path.name != "__main__.py"
]


def allowed(room: str, module: str) -> bool:
    top = module.split(".")[0]
    if top not in ROOMS:
        third_party = top not in sys.stdlib_module_names
        return not third_party or room != "actuators" or top == "numpy"
    inside_app = module.startswith("pipeline.app")
    inside_gap = module.startswith("pipeline.gap")
    inside_twin = module.startswith("pipeline.gap.twin")
    core = top == "pipeline" and not inside_app and not inside_gap
    core = core and (room != "core" or not module.startswith("pipeline.calibration"))
    return {
        "actuators": top == "actuators",
        "core": core or module in LEAVES,
        "gap": core or top == "actuators" or (inside_gap and not inside_twin),
        "twin": core or inside_twin or module in LEAVES,
        # Calibration fits the chain to the robot's demand, so it knows both rooms, like the gap.
        "calibration": core or top == "actuators",
        # Result dataclasses come from the rooms that compute them.
        "reports": top in ("reports", "actuators") or core,
        "app": True,
    }[room]


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_room_imports_only_what_it_may(path: Path) -> None:
    room = room_of(path)
    wrong = [module for module in imports(path) if not allowed(room, module)]
    assert not wrong, f"{path.relative_to(ROOT)} ({room}) imports {', '.join(wrong)}"


def test_the_rule_can_fail() -> None:
    assert not allowed("actuators", "pinocchio")
    assert not allowed("core", "actuators.chain")
    assert not allowed("gap", "pipeline.gap.twin.trial")
    assert not allowed("reports", "pipeline.app.run")
    assert allowed("core", "actuators.units")


def test_leaves_use_the_standard_library_only() -> None:
    for leaf in LEAVES:
        path = ROOT / Path(*leaf.split(".")).with_suffix(".py")
        outside = [
            m
            for m in imports(path)
            if m.split(".")[0] not in sys.stdlib_module_names and m not in LEAVES
        ]
        assert not outside, f"{leaf} imports {outside}"


def test_core_import_is_light() -> None:
    """Pinocchio's room does not drag in the slow plotting and data-frame packages."""
    heavy = {"pandas", "matplotlib", "yourdfpy", "SALib", "pyarrow"}
    for path in FILES:
        if room_of(path) in ("core", "actuators"):
            assert not heavy & {m.split(".")[0] for m in imports(path)}, path
