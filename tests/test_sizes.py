"""Functions are read in one look: none is longer than sixty lines, but those that were before."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONGEST = 60  # lines, signature and docstring included
#: What is longer still, with its length. Entries go, or get smaller; none is added.
LONGER: dict[str, int] = {}


def lengths(body: list[ast.stmt], above: str = "") -> dict[str, int]:
    """Lines of every function of a module and of its classes, by name."""
    out: dict[str, int] = {}
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            out[above + node.name] = node.end_lineno - node.lineno + 1
        elif isinstance(node, ast.ClassDef):
            out |= lengths(node.body, f"{above}{node.name}.")
    return out


def longer_functions() -> dict[str, int]:
    out = {}
    for path in sorted(
        p for r in ("actuators", "pipeline", "reports") for p in (ROOT / r).rglob("*.py")
    ):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for name, lines in lengths(tree.body).items():
            if lines > LONGEST:
                out[f"{path.relative_to(ROOT).as_posix()}:{name}"] = lines
    return out


def test_no_function_is_longer_than_one_look() -> None:
    grown = {name: n for name, n in longer_functions().items() if n > LONGER.get(name, 0)}
    assert not grown, f"split by concept: {grown}"


def test_the_list_of_longer_functions_only_shrinks() -> None:
    stale = sorted(LONGER.keys() - longer_functions().keys())
    assert not stale, f"short enough by now, take it off the list: {stale}"


def test_the_rule_can_fail() -> None:
    long = ast.parse("class A:\n    def f(self):\n" + "        pass\n" * LONGEST)
    assert lengths(long.body) == {"A.f": LONGEST + 1}
