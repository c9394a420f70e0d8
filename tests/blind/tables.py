"""Tables of judged trials: trials, written names, rates with binomial intervals, single effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from tests.blind import judge

_KEYS: Final = ["source", "trial", "kind", "machine"]
_JUDGED: Final = ["verdict", "why", "intervals", "covered", "mass_ratio", "mass_inside"]
NAMES: Final = [*_KEYS, "effect", "place", "level", "rivals", "values", *_JUDGED]
#: Rate, least and most aimed at, what counts, and what of it is a hit; of trials, then of names.
RATES: Final = {
    "trials": (
        ("single right", (0.9, 1.0), "kind == 'single' and visible", "all_found"),
        ("single right of all", None, "kind == 'single'", "all_found"),
        ("several right", (0.7, 1.0), "kind == 'several' and visible", "all_found"),
        ("wrong name confirmed", (0.0, 0.01), "index >= 0", "wrong_confirmed"),
        ("wrong name written", None, "index >= 0", "wrong"),
        ("empty silent", (0.97, 1.0), "kind == 'empty'", "silent"),
        ("empty silent, 1 joint", None, "kind == 'empty' and joints == 1", "silent"),
        ("empty silent, 2 to 9", None, "kind == 'empty' and 1 < joints < 10", "silent"),
        ("empty silent, 10 or more", None, "kind == 'empty' and joints >= 10", "silent"),
        ("outside not confirmed", (0.97, 1.0), "kind == 'outside'", "answered > wrong_confirmed"),
        ("outside unexplained", (0.9, 1.0), "kind == 'outside' and visible", "unexplained"),
        ("answered", (1.0, 1.0), "index >= 0", "answered"),
    ),
    "names": (
        ("names wrong", (0.0, 0.05), "counts", "verdict == 'wrong'"),
        ("confirmed names right", (0.97, 1.0), "counts and level == 'confirmed'", "fits"),
        ("intervals cover", (0.93, 0.97), "intervals", "covered"),
        ("payload mass", None, "mass_ratio > 0", "mass_inside"),
    ),
}


def judged(truth: judge.Truth, answer: dict[str, Any]) -> tuple[dict[str, Any], pd.DataFrame]:
    """A trial's row, and the rows of its written names."""
    names, hidden, rows = judge.read_names(answer["files"]), truth["hidden"], []
    for name in names:
        said, why = judge.verdict(truth, name)
        row = {"effect": name.effect, "place": "+".join(name.place), "level": name.level}
        row |= {"rivals": " ".join(name.rivals), "verdict": said, "why": why}
        row["values"] = " ".join(
            f"{k}={x:.4g}[{low:.4g},{high:.4g}]" for k, (x, low, high) in name.values.items()
        )
        own = next((h for h in hidden if said == judge.RIGHT and judge.says(name, h)), None)
        row["intervals"], row["covered"] = judge.coverage(name, own) if own else (0, 0)
        row["mass_inside"] = False
        if own and own["effect"] == "link_mass":
            (mass, low, high), true = name.values["mass"], own["values"]["mass"]
            row["mass_ratio"] = mass / true
            row["mass_inside"] = abs(mass / true - 1) <= 0.05 or low <= true <= high
        rows.append({key: truth[key] for key in _KEYS} | row)
    verdicts = [(name, row["verdict"]) for name, row in zip(names, rows, strict=True)]
    found = [judge.found(truth, h, verdicts) for h in hidden]
    wrong = [name.level for name, said in verdicts if said == judge.WRONG]
    trial = {key: truth[key] for key in (*_KEYS, "off", "rate_Hz", "bits", "sides")} | {
        "joints": len(truth["joints"]),
        "hidden": ";".join(h["effect"] for h in hidden),
        "z": min((h["z"] for h in hidden), default=np.nan),
        "visible": all(h["visible"] for h in hidden),
        "exit_code": answer["code"],
        "answered": answer["code"] in (0, 1),
        "unexplained": answer["code"] == 1,
        "message": answer["message"],
        "cpu_s": answer["seconds"],
        "written": len(names),
        "all_found": all(found) and bool(found),
        "wrong": bool(wrong),
        "wrong_confirmed": "confirmed" in wrong,
        "silent": answer["code"] == 0 and not wrong,
    }
    return trial, pd.DataFrame(rows, columns=NAMES)


def tables(records: Sequence[dict[str, Any]]) -> dict[str, pd.DataFrame]:
    """Trials, names, rates and effects that were hidden alone, of what `run_trials` returned."""
    rows, parts = zip(*(judged(r["truth"], r["answer"]) for r in records), strict=True)
    trials, names = pd.DataFrame(list(rows)), pd.concat(parts, ignore_index=True)
    # Bodies are fitted link by link, and are one name.
    again = (names["effect"] == judge.WHOLE) & names.duplicated([*_KEYS, "effect"], keep="last")
    names["counts"] = (names["verdict"] != judge.DRAWN) & ~again
    names["fits"] = names["verdict"].isin([judge.RIGHT, judge.CLASS])
    alone = trials[trials["kind"].isin(["single", "outside"])].groupby(["hidden", "source"])
    counted = ["visible", "all_found", "unexplained", "wrong", "wrong_confirmed"]
    effects = alone[counted].sum().assign(trials=alone.size()).reset_index()
    rates, sources = [], sorted(trials["source"].unique())
    for source in [*sources, "all"] if len(sources) > 1 else sources:
        for table, of in (("trials", trials), ("names", names)):
            part = of if source == "all" else of[of["source"] == source]
            for rate, aim, among, hit in RATES[table]:
                count = part.eval(among).astype(int)
                k, n = int(np.minimum(count, part.eval(hit)).sum()), int(count.sum())
                if n:
                    low, high = binomtest(k, n).proportion_ci(method="wilson")
                    least, most = aim or (np.nan, np.nan)
                    reached = least <= k / n <= most if aim else None
                    rates.append((source, rate, k, n, k / n, low, high, least, most, reached))
    header = ["source", "rate", "hits", "count", "share", "low", "high"]
    shares = pd.DataFrame(rates, columns=[*header, "aim_low", "aim_high", "reached"])
    return {"trials": trials, "names": names, "rates": shares, "by_effect": effects}
