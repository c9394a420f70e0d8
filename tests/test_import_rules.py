"""Rooms import downwards only, from the command line to the actuators."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: From the top down; a room imports itself and what stands below it.
ORDER = (
    *(
        "cli",
        "choice",
        "sweep",
        "measured",
        "api",
        "reports",
        "blind",
        "paper",
        "identification",
        "simulation",
        "effects",
        "machine",
    ),
    *("logs", "dynamics", "motion", "robot", "actuators"),
)
#: Seen by everybody: types of arrays, errors, units, how files are read.
LEAVES = {
    "actuators.arrays",
    *("actuators.units", "actuators.parameters", "actuators.errors", "actuators.text_file"),
    "actuators.checked",
    *(
        "pipeline.atomic",
        "pipeline.checkpoint",
        "pipeline.column",
        "pipeline.errors",
        "pipeline.spread",
    ),
}
#: Numbers, and the library by which files are read.
ACTUATORS_NEED = {"numpy", "scipy", "pydantic", "pydantic_core"}
#: No room stands on the actuators' laws before there is a machine.
WITHOUT_LAWS = {"robot", "motion", "dynamics"}
#: Where the twin lives, which shares no law with the workflow that it tests.
TWIN = "pipeline.blind.machines"
SHARE = 0.2  # of all lines, at most, in one room
FILES_IN_FOLDER = 14


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def room_of(module: str) -> str:
    """The room of one of our modules; empty for others and for what stands above the rooms."""
    first, *rest = module.split(".")
    if first in ("actuators", "reports"):
        return first
    return rest[0] if first == "pipeline" and rest and rest[0] in ORDER else ""


FILES = sorted(
    path
    for top in ("actuators", "pipeline", "reports")
    for path in (ROOT / top).rglob("*.py")
    if room_of(module_of(path))
)


def allowed(module: str, target: str) -> bool:
    top = target.split(".")[0]
    room, other = room_of(module), room_of(target)
    if top not in ("actuators", "pipeline", "reports"):
        known = top in sys.stdlib_module_names or top in ACTUATORS_NEED
        return known or room != "actuators"
    if target in LEAVES or any(target.startswith(f"{leaf}.") for leaf in LEAVES):
        return room != "actuators" or top == "actuators"
    if module.startswith(TWIN):
        return target.startswith(TWIN) or other in WITHOUT_LAWS
    if TWIN in target:
        return room in ("blind", "cli")
    if other == "actuators" and room in WITHOUT_LAWS:
        return False
    # `pipeline` itself is the public API, which knows all rooms; `reports` the name of a room.
    return bool(other) and ORDER.index(room) <= ORDER.index(other)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_room_imports_only_what_stands_below_it(path: Path) -> None:
    module = module_of(path)
    wrong = [target for target in imports(path) if not allowed(module, target)]
    assert not wrong, f"{module} imports {', '.join(wrong)}"


def test_no_two_files_import_each_other() -> None:
    """Not for types alone either: whoever reads one need not read the other first."""
    known = {module_of(path) for path in FILES}
    graph = {module_of(path): {*imports(path)} & known for path in FILES}
    TopologicalSorter(graph).prepare()  # raises CycleError, which names them


def test_the_rule_can_fail() -> None:
    assert not allowed("actuators.shaft", "pinocchio")
    assert not allowed("pipeline.robot.robot", "actuators.chain")
    assert not allowed("pipeline.identification.results", "pipeline.blind.machines.trial")
    assert not allowed("pipeline.blind.machines.plant", "actuators.elements.element")
    assert not allowed("pipeline.simulation.predict", "reports.table")
    assert not allowed("reports.page", "pipeline.cli.main")
    assert allowed("pipeline.robot.robot", "actuators.units")
    assert allowed("reports.page", "pipeline.simulation.predict")


def test_leaves_use_the_standard_library_numpy_what_reads_files_the_bar_and_workers_only() -> None:
    allowed_there = sys.stdlib_module_names | {
        *("numpy", "pydantic", "pydantic_core", "tqdm", "distributed")
    }
    for leaf in LEAVES:
        path = ROOT / Path(*leaf.split(".")).with_suffix(".py")
        modules = {m for m in imports(path) if m.split(".")[0] not in allowed_there}
        outside = [m for m in modules if m not in LEAVES and m.rpartition(".")[0] not in LEAVES]
        assert not outside, f"{leaf} imports {outside}"


def test_core_import_is_light() -> None:
    """Pinocchio's rooms do not drag in the slow plotting and data-frame packages."""
    heavy = {"pandas", "matplotlib", "yourdfpy", "SALib", "pyarrow"}
    for path in FILES:
        if room_of(module_of(path)) in WITHOUT_LAWS | {"actuators"}:
            assert not heavy & {m.split(".")[0] for m in imports(path)}, path


def test_no_room_outgrows_the_others() -> None:
    lines = Counter[str]()
    for path in FILES:
        lines[room_of(module_of(path))] += len(path.read_text(encoding="utf-8").splitlines())
    total = sum(lines.values())
    large = {room: n / total for room, n in lines.items() if n > SHARE * total}
    assert not large


def test_no_folder_is_a_flat_pile() -> None:
    files = Counter(path.parent for path in FILES if path.name != "__init__.py")
    piles = {str(f.relative_to(ROOT)): n for f, n in files.items() if n > FILES_IN_FOLDER}
    assert not piles


def test_tests_mirror_the_rooms() -> None:
    """Whoever knows where the code is knows where its tests are; no folder of them is a pile."""
    tests = ROOT / "tests"
    shared = {"data_files", "__pycache__"}
    names = {path.name for path in (tests / "pipeline").iterdir() if path.is_dir()} - shared
    assert names <= {room for room in ORDER if (ROOT / "pipeline" / room).is_dir()}
    assert not list((tests / "pipeline").glob("test_*.py"))
    files = Counter(path.parent for path in tests.rglob("test_*.py"))
    assert {str(f.relative_to(ROOT)) for f, n in files.items() if n > FILES_IN_FOLDER} == set()


def test_the_command_line_starts_without_what_computes() -> None:
    """`--help` and a wrong option answer at once."""
    code = "import sys, pipeline.cli.main; print(*{m.split('.')[0] for m in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert "pipeline" in loaded.stdout
    assert not {"numpy", "scipy", "pandas", "pinocchio", "matplotlib"} & {*loaded.stdout.split()}
