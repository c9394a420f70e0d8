"""How often `gap power` finds what stands between battery and motors of a simulated hexapod."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from pipeline.identification.supply.account import account
from pipeline.identification.workflow.compared import load_logs
from tests.blind.machines.supply import make_supply
from tests.compared import as_compared

SEED, TRIALS = 202, 20
#: Terms that may stand in the answer beside what is hidden: windings of a leg that rubs carry more.
BESIDE = {"extra_friction": {"more_copper", "more_friction", "drivers"}}


def trial(k: int, folder: Path) -> Counter[str]:
    """Right, missed and wrong names, constants within 1 W, and wrong sums."""
    truth, given = make_supply(SEED, k, folder), folder / "given"
    asked, machine = as_compared(
        given / "log.parquet",
        step="power",
        robot=given / "urdf" / "hexapod.toml",
        alternative="ideal",
        mapping=given / "mapping.toml" if truth["stated"] else None,
    )
    told = account(machine, load_logs(machine, asked).logs, 0, None)
    hidden = set(truth["hidden"])
    if "wrong_sum" in hidden or told.wrong_sum:
        right = told.wrong_sum and "wrong_sum" in hidden
        return Counter({"sums right" if right else "sums wrong": 1})
    names = {n for n in ("constant", "drivers") if n in hidden}
    names |= {f"extra_friction {truth['leg']}"} if "extra_friction" in hidden else set()
    may = (names | ({"returned"} & hidden)).union(*(BESIDE.get(n, set()) for n in hidden))
    found = told.power[told.power["basis"] == "found"].set_index("term")
    classes = [{t, *like.split("+")} for t, like in found["indistinguishable_from"].items()]
    out = Counter({"hidden": len(names), "named": len(found)})
    out["found"] = sum(any(n in one for one in classes) for n in names)
    out["wrong"] = sum(not one & may for one in classes)
    if "constant" in found.index and "constant" in hidden:
        out["constants"] += 1
        out["within 1 W"] += abs(found.loc["constant", "mean_W"] - truth["constant"]) < 1.0
    return out


@pytest.mark.slow
def test_what_is_hidden_is_found_and_nothing_else(tmp_path: Path) -> None:
    """The rates of the package's README, less what a few trials more or less may change."""
    total: Counter[str] = Counter()
    for k in range(TRIALS):
        total += trial(k, tmp_path / str(k))
    assert total["found"] >= 0.9 * total["hidden"], total
    assert total["wrong"] <= 0.1 * total["named"], total
    assert total["sums right"] > total["sums wrong"] == 0, total
    assert total["within 1 W"] >= 0.9 * total["constants"], total
