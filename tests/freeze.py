"""Everything that runs write, frozen, so that a rebuilt room can be held against what it was.

`python -m tests.freeze DIR` runs commands and keeps their files; `python -m tests.freeze DIR
--against OTHER` says what differs between two of them, number by number for tables. `--only` takes
the runs whose names contain a text.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).resolve().parents[1]
DEMO = "pipeline/identification/demo"
#: Of figures and pages the hash is kept.
HASHED = (".png", ".svg", ".glb")
#: What no two runs have in common, or only says which code it was.
ANY = [
    r"\b[0-9a-f]{7,40}\b",
    r"/tmp/[\w/.-]*",
    r"\d{4}-\d\d-\d\d[T ][\d:.]+\S*",
    r"\d+(\.\d+)? s\b",
]
#: Changes that make a gait of the robot file's own.
GAITS = {
    "hexapod": {"file": "", "ripple": "gait.name=ripple", "wave": "gait.name=wave"},
    "solo12": {"file": "", "slower": "gait.duty_factor=0.9", "aside": "gait.heading=60 deg"},
    "anymal_c": {"file": "", "slower": "gait.duty_factor=0.9", "aside": "gait.heading=60 deg"},
}


def runs() -> Iterator[tuple[str, list[str]]]:
    """Name and command of each run; `OUT` stands for its folder."""
    for robot, gaits in GAITS.items():
        to = ["--robot", f"urdf/{robot}.toml", "--samples", "51", "--out", "OUT"]
        yield f"{robot}_stand", ["stand", *to]
        for name, change in gaits.items():
            more = ["--set", change, "--set", "gait.sway=least"] if change else []
            yield f"{robot}_{name}", ["walk", *to, *more]
        slope = ["gait.slope_forward=3 deg", "gait.payload_mass=2 kg", "gait.payload_x=20 mm"]
        sets = [word for change in slope for word in ("--set", change)]
        yield f"{robot}_slope", ["walk", *to, *sets, "--set", "gait.sway=least", "--compare-forces"]
        yield f"{robot}_reports", ["reports", *to]
    yield "hexapod_bus", ["walk", "--samples", "51", "--regeneration", "bus", "--out", "OUT"]
    ideal = ["--forces", "least_power", "--power-of", "reversible"]
    yield "hexapod_power", ["walk", "--samples", "51", *ideal, "--out", "OUT"]
    turning = ["--set", "gait.yaw_rate=5 deg/s", "--quasi-static", "--decimal", "comma"]
    yield "hexapod_turn", ["walk", "--samples", "51", *turning, "--out", "OUT"]
    for robot in ("hexapod", "leg", "anymal_c", "hexapod_axis90"):
        yield f"check_{robot}", ["check", f"urdf/{robot}.toml"]
    yield "init_go2", ["init", "go2", "--out", "OUT/go2.toml"]
    yield "init_b1", ["init", "b1", "--out", "OUT/b1.toml"]
    yield (
        "gap",
        ["gap", f"{DEMO}/walk.parquet", "--holdout", f"{DEMO}/walk_slow.parquet", "--out", "OUT"],
    )
    yield "twin", ["twin", "--seed", "3", "--machine", "leg", "--out", "OUT"]


def refusals(folder: Path) -> Iterator[tuple[str, list[str]]]:
    """Commands that are refused: those of the tests of bad input."""
    from tests.pipeline.cli import test_bad_input as bad
    from tests.pipeline.cli.robots import changed, edited_robot, own_robot

    walk = ["walk", "--samples", "51", "--out", "OUT"]
    for what, (change, _) in bad.CHANGES.items():
        yield f"set {what}", [*walk, "--set", change]
    for what, (more, _) in bad.OPTIONS.items():
        yield f"option {what}", [*walk, *more]
    for what, (changes, _, _) in bad.GAITS.items():
        verb = "stand" if changes[0].startswith("standing") else "walk"
        sets = [word for change in changes for word in ("--set", change)]
        yield f"gait {what}", [verb, *walk[1:], *sets]
    for what, (pattern, replacement, _) in bad.ROBOT_FILES.items():
        (here := folder / f"file_{what}").mkdir()
        robot = edited_robot(ROOT, here, pattern, replacement)
        yield f"robot {what}", [*walk, "--robot", str(robot)]
    for what, (pattern, replacement, _) in bad.OWN_FILES.items():
        (here := folder / f"own_{what}").mkdir()
        robot = own_robot(ROOT, here, "</robot>", "</robot>")
        robot.write_text(changed(robot.read_text("utf-8"), pattern, replacement), "utf-8")
        yield f"own {what}", [*walk, "--robot", str(robot)]


def run(arguments: list[str]) -> str:
    """Exit code and what was printed, without what no two runs have in common."""
    from tests.command_line import exit_code

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = exit_code(arguments)
    return plain(f"exit {code}\n{out.getvalue()}\n--\n{err.getvalue()}")


def plain(text: str) -> str:
    """Text without what no two runs have in common."""
    for pattern in ANY:
        text = re.sub(pattern, "*", text)
    return text


def keep(source: Path, target: Path) -> None:
    """Copy what a run wrote; hashes of pictures, plain text of pages."""
    for path in sorted(source.rglob("*")):
        if not path.is_file() or path.name.startswith("."):
            continue
        to = target / path.relative_to(source)
        to.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix in HASHED:
            to.with_name(to.name + ".sha").write_text(hashlib.sha256(path.read_bytes()).hexdigest())
        elif path.suffix in (".html", ".toml", ".md", ".json"):
            to.write_text(plain(path.read_text("utf-8")), "utf-8")
        else:
            shutil.copyfile(path, to)


def freeze(target: Path, only: str) -> None:
    """Run everything, keep everything."""
    os.chdir(ROOT)
    target.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        scratch = Path(temporary)
        for name, command in runs():
            if only not in name:
                continue
            (target / name).mkdir(exist_ok=True)
            (made := scratch / name).mkdir()
            said = run([word.replace("OUT", str(made / "run")) for word in command])
            (target / name / "printed.txt").write_text(said, "utf-8")
            keep(made, target / name)
            print(name, said.split("\n", 1)[0], flush=True)
        if only not in "refusals":
            return
        lines = []
        for name, command in refusals(scratch):
            out = str(scratch / "refused")
            lines.append(f"{name}: {run([word.replace('OUT', out) for word in command])}")
        (target / "refusals.txt").write_text("\n".join(lines), "utf-8")


def difference(a: Path, b: Path) -> str:
    """How two files differ, one line; empty where they do not."""
    if a.read_bytes() == b.read_bytes():
        return ""
    if a.suffix != ".csv":
        pairs = zip(
            a.read_text("utf-8").split("\n"), b.read_text("utf-8").split("\n"), strict=False
        )
        first = next(((x, y) for x, y in pairs if x != y), ("", ""))
        at = next((k for k, (x, y) in enumerate(zip(*first, strict=False)) if x != y), 0)
        old, new = (line[max(at - 30, 0) : at + 60] for line in first)
        return f"`{old}` became `{new}`"
    comma = a.read_bytes().startswith(b"\xef\xbb\xbf")  # as `--decimal comma` writes
    x, y = (
        pd.read_csv(p, sep=";" if comma else ",", decimal="," if comma else ".") for p in (a, b)
    )
    if list(x.columns) != list(y.columns) or len(x) != len(y):
        odd = set(x.columns) ^ set(y.columns)
        return f"{len(x)} rows became {len(y)}; columns that differ: {sorted(odd)}"
    worst = []
    for column in x.columns:
        one, two = x[column], y[column]
        if one.equals(two):
            continue
        if one.dtype.kind == "f" == two.dtype.kind:
            share = float(np.nanmax(np.abs(one - two)) / max(float(np.nanmax(np.abs(one))), 1e-300))
            worst.append(f"{column} by {share:.1e} of its largest")
        else:
            worst.append(f"{column} in {int((one.astype(str) != two.astype(str)).sum())} cells")
    return ", ".join(worst) or "in its bytes only"


def compare(now: Path, before: Path, only: str) -> int:
    """Print what differs; the number of files that do."""
    names = {p.relative_to(d) for d in (now, before) for p in d.rglob("*") if p.is_file()}
    count = 0
    for name in sorted(names):
        if only not in str(name) or not (now / name.parts[0]).exists():
            continue
        if not (now / name).exists() or not (before / name).exists():
            said = "is new" if (now / name).exists() else "is gone"
        else:
            said = difference(before / name, now / name)
        if said:
            count += 1
            print(f"{name}: {said}")
    print(f"{count} of {len(names)} files differ")
    return count


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.freeze")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    freeze(given.folder.resolve(), given.only)
    return bool(given.against and compare(given.folder.resolve(), given.against, given.only))


if __name__ == "__main__":
    raise SystemExit(main())
