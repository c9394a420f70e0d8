"""Rows of elements are evaluated in one file, and machines ask for it in one room."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[3]
ANSWERS = ("inverse", "holding", "forward", "loss", "stored", "drawn")


def asks_elements(text: str) -> bool:
    """Whether code calls an element's answers, by whatever name it goes in a loop over elements."""
    for loop in ast.walk(ast.parse(text if "elements" in text else "")):
        if not isinstance(loop, ast.For) or "elements" not in ast.unparse(loop.iter):
            continue
        for call in ast.walk(loop):
            if (
                isinstance(call, ast.Call)
                and isinstance(call.func, ast.Attribute)
                and call.func.attr in ANSWERS
            ):
                return True
    return False


def test_a_row_of_elements_is_evaluated_in_one_file() -> None:
    files = [p for top in ("actuators", "pipeline", "reports") for p in (ROOT / top).rglob("*.py")]
    asking = {str(p.relative_to(ROOT)) for p in files if asks_elements(p.read_text("utf-8"))}
    assert asking == {"actuators/chain.py"}


def test_the_rule_can_fail() -> None:
    loop = "for law in reversed(joint.elements):\n    side = law.{}(side)\n"
    assert asks_elements(loop.format("forward"))
    assert not asks_elements(loop.format("name"))
