"""Numbers that must not move while packages are rebuilt: `tests/frozen.csv`, held against a run.

`python -m tests.freeze` runs the commands and prints what differs from the file (exit 1), numbers
of tables by more than 1e-9 of their value, what `gap` finds by more than 1e-6, names at all;
`--write` replaces the rows of what it ran. `--only` takes the sources whose names contain a text.
`--logs DIR` adds the logs of blind trials, folders with `given/` and `truth.json` that are kept
outside the repository, of each source the first `--trials`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).resolve().parents[1]
FROZEN = Path(__file__).with_name("frozen.csv")
DEMO = ROOT / "pipeline" / "identification" / "demo"
KEYS = ["source", "item", "quantity"]
TABLES, FOUND = 1e-9, 1e-6
#: An answer that takes longer counts as none [s of CPU].
PATIENCE = 400
SLOPE = ["--set", "gait.slope_forward=3 deg", "--set", "gait.sway=least"]
PAYLOAD = ["--set", "gait.payload_mass=5 kg", "--set", "gait.payload_x=50 mm"]
ROBOTS = {
    "hexapod": ["--robot", "urdf/hexapod.toml"],
    "solo12": ["--robot", "urdf/solo12.toml"],
    "anymal_c": ["--robot", "urdf/anymal_c.toml"],
    "payload": ["--robot", "urdf/hexapod.toml", *PAYLOAD],
    "slope": ["--robot", "urdf/hexapod.toml", *SLOPE],
}
#: Verb and table to the columns that name a row and the numbers of it; all others are left out.
TABLES_OF: dict[tuple[str, str], tuple[list[str], list[str]]] = {
    ("stand", "standing"): (
        ["alternative", "joint"],
        ["joint_torque_Nm", "motor_torque_Nm", "current_A", "voltage_V", "power_W"],
    ),
    ("stand", "standing_energy"): (["alternative", "leg"], ["energy_J"]),
    ("walk", "walking_energy"): (["alternative", "leg"], ["electrical_J"]),
    ("walk", "robot_energy"): (
        ["alternative"],
        ["energy_per_cycle_J", "average_power_W", "cost_of_transport", "dissipated_J"],
    ),
    ("walk", "walking_stability"): (["segment"], ["least_margin_m", "least_normal_force_N"]),
    ("walk", "walking_losses"): (["alternative", "joint", "element"], ["loss_J"]),
    ("walk", "motor_limits"): (["alternative", "joint", "quantity"], ["limit", "peak"]),
    ("reports", "reproduction"): (["id"], ["computed"]),
}
Rows = list[dict[str, object]]


def command(arguments: list[str], out: Path, folder: Path = ROOT) -> int:
    """Run a verb in a process of its own; its exit code, which must not be that of bad input."""
    limited = ["/bin/sh", "-c", f'ulimit -t {PATIENCE}; exec "$@"', "run", sys.executable, "-P"]
    more = ["-m", "pipeline", *arguments, "--out", str(out)]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    environment = os.environ | threads | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    run = subprocess.run([*limited, *more], cwd=folder, env=environment, capture_output=True)
    return run.returncode if run.returncode in (0, 1, 2) else -1


def table_rows(source: str, verb: str, folder: Path) -> Rows:
    rows: Rows = []
    for (of, table), (names, numbers) in TABLES_OF.items():
        if of != verb or not (path := folder / f"{table}.csv").exists():
            continue
        frame = pd.read_csv(path, keep_default_na=False, na_values={n: [""] for n in numbers})
        for _, row in frame.iterrows():
            item = " ".join(str(row[name]) for name in names if str(row[name]))
            for number in numbers:
                quantity = f"{verb} {table}.{number}"
                rows.append(
                    {"source": source, "item": item, "quantity": quantity, "value": row[number]}
                )
    return rows


def found_rows(source: str, code: int, folder: Path) -> Rows:
    """Exit code, and every name of the model file with its values and level."""
    rows: Rows = [{"source": source, "item": "exit", "quantity": "code", "value": code}]
    path = folder / "model.toml"
    edits = tomllib.loads(path.read_text("utf-8")).get("edit", []) if path.exists() else []
    for edit in edits:
        item = f"{edit['effect']} at {'+'.join(edit.get('place', []))} {edit.get('level', '')}"
        for name, entry in edit["parameters"].items():
            value = entry["value"]
            rows.append({"source": source, "item": item, "quantity": name, "value": value})
    return rows


def cases(logs: Path | None, trials: int) -> Iterator[tuple[str, str, list[str], Path]]:
    """Source, verb, arguments and the folder they are run in."""
    for robot, arguments in ROBOTS.items():
        yield robot, "stand", arguments, ROOT
        yield robot, "walk", [*arguments, "--samples", "201"], ROOT
    yield "hexapod", "reports", ROBOTS["hexapod"], ROOT
    more = ["--holdout", str(DEMO / "walk_slow.parquet")]
    yield "demonstration", "gap", [str(DEMO / "walk.parquet"), *more], ROOT
    for folder in sorted(logs.glob("*/*")) if logs else ():
        if int(folder.name) < trials:
            options = json.loads((folder / "truth.json").read_text("utf-8"))["options"]
            yield f"{folder.parent.name} {folder.name}", "gap", options, folder / "given"


def computed(case: tuple[str, str, list[str], Path]) -> Rows:
    source, verb, arguments, folder = case
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "run"
        code = command([verb, *arguments], out, folder)
        print(source, verb, "exit", code, file=sys.stderr, flush=True)
        return found_rows(source, code, out) if verb == "gap" else table_rows(source, verb, out)


def differences(old: pd.DataFrame, new: pd.DataFrame) -> list[str]:
    """One line for each row that is gone, new or has moved."""
    both = old.merge(new, "outer", on=[*KEYS, "turn"], suffixes=("", "_now"), indicator=True)
    lines = []
    for _, row in both.iterrows():
        name = " | ".join(str(row[key]) for key in KEYS)
        if row["_merge"] != "both":
            gone = row["_merge"] == "left_only"
            lines.append(f"{name}: {row['value']} is gone" if gone else f"{name}: is new")
            continue
        a, b = (pd.to_numeric(row[key], errors="coerce") for key in ("value", "value_now"))
        tables = str(row["quantity"]).split(" ")[0] in {verb for verb, _ in TABLES_OF}
        close = np.isclose(b, a, rtol=TABLES if tables else FOUND, atol=1e-12, equal_nan=True)
        if not close:
            lines.append(f"{name}: {a:.12g} became {b:.12g}")
    return lines


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.freeze")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--logs", type=Path)
    parser.add_argument("--trials", type=int, default=6)
    given = parser.parse_args()
    logs = given.logs.resolve() if given.logs else None
    todo = [c for c in cases(logs, given.trials) if given.only in f"{c[0]} {c[1]}"]
    with ThreadPoolExecutor(2) as pool:
        rows = [row for found in pool.map(computed, todo) for row in found]
    new = pd.DataFrame(rows, columns=[*KEYS, "value"])
    old = pd.read_csv(FROZEN) if FROZEN.exists() else new.iloc[:0]
    ran = {(source, verb) for source, verb, *_ in todo}
    verbs = old["quantity"].str.split(" ").str[0]
    verbs = verbs.where(verbs.isin({verb for verb, _ in TABLES_OF}), "gap")
    again = [pair in ran for pair in zip(old["source"], verbs, strict=True)]
    for frame in (old, new):
        frame["turn"] = frame.groupby(KEYS).cumcount()
    if given.write:
        kept = old[~np.array(again, dtype=bool)] if len(old) else old
        pd.concat([kept, new])[[*KEYS, "value"]].to_csv(FROZEN, index=False)
        return 0
    lines = differences(old[again], new)
    print(*lines, f"{len(lines)} of {len(new)} numbers differ", sep="\n")
    return bool(lines)


if __name__ == "__main__":
    raise SystemExit(main())
