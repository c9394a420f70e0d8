"""Odd inputs over all verbs, drawn by seed: one thing of a valid command is spoilt at a time.

A bad answer is a traceback, a warning of a library, an exit code of none of 0, 1 and 2, a refusal
of more or less than one line or that leaves files, a number in a table that is not finite.
"""

import io
import re
import shutil
import tempfile
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
import pytest

from tests.command_line import exit_code

ROOT: Final = Path(__file__).parents[1]
NUMBER: Final = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][+-]?\d+)?")
ODD_NUMBERS: Final = ("nan", "inf", "-1", "0", "1e300", "1e-300", "", "true", '"x"', "1,5", "--")
UNITS: Final = ("mm", "m", "deg", "rad", "kg", "g", "s", "N*m", "mN*m", "A", "V", "rpm", "ohm", "W")

#: One command, and what was spoilt.
Case = tuple[tuple[str, ...], str]


def pendulum_log(path: Path) -> None:
    """Eight seconds of a swinging arm with friction, in the log format."""
    t = np.arange(0.0, 8.0, 0.01)
    q, v, a = 0.8 * np.sin(3 * t), 2.4 * np.cos(3 * t), -7.2 * np.sin(3 * t)
    torque = 0.49 * (0.1**2 * a + 9.81 * 0.1 * np.sin(q)) + 0.03 * np.sign(v)
    columns = {"position_rad": q, "velocity_rad_s": v, "torque_Nm": torque}
    table = pd.DataFrame({f"pendulum_joint__{name}": x for name, x in columns.items()})
    table.insert(0, "time_s", t)
    table.round(6).to_csv(path, index=False)


def written(folder: Path) -> None:
    """Files of every kind that verbs read."""
    for name in ("hexapod.toml", "hexapod.urdf"):
        shutil.copyfile(ROOT / "urdf" / name, folder / name)
    shutil.copytree(ROOT / "actuators" / "catalog", folder / "actuators")
    shutil.copytree(ROOT / "actuators" / "components", folder / "parts")
    shutil.copyfile(ROOT / "tests/pipeline/data_files/xl330.urdf", folder / "pendulum.urdf")
    pendulum_log(folder / "log.csv")
    gait = 'extends = "hexapod.toml"\n[gait]\ntransfer_path = "cubic"\nslope_forward = "2 deg"\n'
    (folder / "gait.toml").write_text(gait)
    shutil.copyfile(ROOT / "pipeline/choice/day.csv", folder / "mission.csv")
    mapping = '[columns."pendulum_joint__torque_Nm"]\nscale = 1.0\nunit = "N*m"\n'
    (folder / "mapping.toml").write_text(mapping)


#: Verb and its words; ``FILE`` in braces is a file that may be spoilt, `{}` an option's value.
COMMANDS: Final[tuple[tuple[str, ...], ...]] = (
    ("check", "{hexapod.toml}"),
    ("check", "{hexapod.urdf}"),
    ("check", "{pendulum.urdf}"),
    ("init", "{hexapod.urdf}", "--out", "OUT.toml"),
    ("init", "{pendulum.urdf}", "--out", "OUT.toml"),
    ("stand", "--robot", "{hexapod.toml}", "--out", "OUT"),
    ("walk", "--robot", "{hexapod.toml}", "--samples", "=51", "--out", "OUT"),
    ("walk", "--robot", "{gait.toml}", "--samples", "51", "--out", "OUT"),
    ("walk", "--set", "=gait_period=3", "--samples", "51", "--out", "OUT"),
    ("walk", "--set", "=gait.payload_mass=5 kg", "--samples", "51", "--out", "OUT"),
    ("walk", "--set", "=harmonic_drive.load=0.1", "--samples", "51", "--out", "OUT"),
    ("walk", "--set", "=walking_speed=9.6", "--samples", "51", "--out", "OUT"),
    ("walk", "--friction-coefficient", "=0.8", "--samples", "51", "--out", "OUT"),
    ("walk", "--regeneration", "=0.5", "--samples", "51", "--out", "OUT"),
    ("stand", "--actuators", "{actuators/harmonic_drive.toml}", "--out", "OUT"),
    ("stand", "--actuators", "{actuators/alternatives.toml}", "--out", "OUT"),
    ("stand", "--actuators", "{actuators/motor_re40_24v.toml}", "--out", "OUT"),
    ("components", "--parts", "{parts/motor.csv}"),
    ("components", "--parts", "{parts/planetary.csv}"),
    ("gap", "read", "{log.csv}", "--robot", "pendulum.urdf", "--out", "OUT"),
    ("gap", "read", "log.csv", "--robot", "{pendulum.urdf}", "--out", "OUT"),
    ("gap", "where", "{log.csv}", "--robot", "pendulum.urdf", "--out", "OUT"),
    ("gap", "where", "log.csv", "--robot", "pendulum.urdf", "--cutoff", "=10", "--out", "OUT"),
    ("gap", "read", "log.csv", "--robot", "pendulum.urdf", "--mapping", "{mapping.toml}")
    + ("--out", "OUT"),
    ("gap", "mapping", "{log.csv}", "--robot", "pendulum.urdf", "--out", "OUT.toml"),
    (
        *("init-actuator", "own", "--out", "OUT", "--source", "a sheet", "--shaft", "output"),
        *("--stall-torque", "=4.1 N*m", "--stall-current", "=2.3 A", "--supply-voltage", "=12 V"),
        *("--no-load-speed", "=46 rpm", "--gear-ratio", "=353.5", "--mass", "=82 g"),
    ),
)
#: The same for what takes longer.
LONG_COMMANDS: Final[tuple[tuple[str, ...], ...]] = (
    ("choose", "--mission", "{mission.csv}", "--draws", "10", "--out", "OUT"),
    ("gap", "{log.csv}", "--robot", "pendulum.urdf", "--out", "OUT"),
    ("reports", "--robot", "{hexapod.toml}", "--out", "OUT"),
    ("sweep", "--vary", "=gait_period=3,4", "--samples", "51", "--out", "OUT"),
)


def spoilt_value(value: str, draw: np.random.Generator) -> str:
    """An option's value with another number, unit or name."""
    name, equals, number = value.rpartition("=")
    first, _, unit = number.partition(" ")
    other = draw.choice([*ODD_NUMBERS, "1e9", "1e-9", "-0", "9" * 400, "\u0663", "3 3"])
    ways = [f"{name}{equals}{first} {draw.choice(UNITS)}", f"{name[:-1]}x{equals}{number}"]
    ways += [f"{name}{equals}{other} {unit}".rstrip()] * 2
    return str(draw.choice(ways))


def spoilt_text(text: str, draw: np.random.Generator, others: Sequence[str]) -> bytes:
    """A file's text with one thing wrong."""
    lines = text.splitlines()
    at = int(draw.integers(max(len(lines), 1)))
    numbers = [*NUMBER.finditer(text)]
    words = [*re.finditer(r"[A-Za-z_]{3,}", text)]

    def replaced(matches: Sequence[re.Match[str]], new: str) -> str:
        if not matches:
            return new
        m = matches[int(draw.integers(len(matches)))]
        return text[: m.start()] + new.replace("{}", m[0]) + text[m.end() :]

    def some(*texts: str) -> str:
        return str(draw.choice(np.array(texts, dtype=object)))

    changes: list[Callable[[], str | bytes]] = [
        lambda: text[: int(draw.integers(len(text) + 1))],
        lambda: "\n".join(lines[:at] + lines[at + 1 :]),
        lambda: "\n".join([*lines[:at], *lines[at : at + 1] * 2, *lines[at + 1 :]]),
        lambda: "\n".join(lines[::-1]),
        *[lambda: replaced(numbers, some(*ODD_NUMBERS))] * 5,
        *[lambda: replaced(numbers, some("{}000", "-{}", "{}e3", "{}e-3"))] * 3,
        *[lambda: replaced(words, some("{}x", "", "x", "nan", "{} {}"))] * 3,
        lambda: text.replace(",", ";"),
        lambda: text.replace(".", ","),
        lambda: text.encode("utf-16"),
        lambda: text.encode()[: len(text) // 2] + bytes(draw.integers(0, 256, 60, dtype=np.uint8)),
        *(lambda whole=whole: whole for whole in ("", "\n\n", bytes(1000))),
        lambda: some(*others),
    ]
    out = changes[int(draw.integers(len(changes)))]()
    return out if isinstance(out, bytes) else out.encode()


def spoilt(folder: Path, draw: np.random.Generator, commands: Sequence[Sequence[str]]) -> Case:
    """A command of which one option's value or one file is spoilt, the files in the folder."""
    words = [*commands[int(draw.integers(len(commands)))]]
    places = [k for k, word in enumerate(words) if word[0] in "={" and len(word) > 1]
    chosen = places[int(draw.integers(len(places)))]
    said = ""
    for k in places:
        word = words[k]
        if word[0] == "=":
            words[k] = spoilt_value(word[1:], draw) if k == chosen else word[1:]
            said = words[k] if k == chosen else said
            continue
        path = folder / word[1:-1]
        if k == chosen:
            others = [p.read_text() for p in sorted(folder.iterdir()) if p.is_file()]
            path.write_bytes(spoilt_text(path.read_text(), draw, others))
            said = word[1:-1]
        words[k] = str(path.parent if path.parent != folder else path)
    out = str(folder / "out")
    words = [word.replace("OUT", out) if word.startswith("OUT") else word for word in words]
    files = {path.name for path in folder.iterdir()}
    return tuple(str(folder / word) if word in files else word for word in words), said


def fault(words: Sequence[str], out: Path) -> str:
    """What is wrong with the answer to a command; empty for a good answer."""
    told, printed = io.StringIO(), io.StringIO()
    with warnings.catch_warnings(record=True) as heard, redirect_stderr(told):
        warnings.simplefilter("always")
        try:
            with redirect_stdout(printed):
                code = exit_code(words)
        except BaseException:
            return "traceback: " + traceback.format_exc().strip().replace("\n", " | ")[-600:]
    said = told.getvalue()
    if heard:
        return f"warning: {heard[0].message} ({heard[0].filename}:{heard[0].lineno})"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if code == 2:
        if said.count("\n") != 1 or not said.strip():
            return f"refused in {said.count(chr(10))} lines: {said[:300]!r}"
        return f"refused, and leaves {out.name}" if out.exists() else ""
    for path in sorted(out.glob("*.csv")) if out.is_dir() else ():
        table = pd.read_csv(path)
        numbers = table.select_dtypes("number").to_numpy(dtype=float)
        if np.isinf(numbers).any():
            return f"{path.name}: an infinite number"
        for name, cells in pd.read_csv(path, dtype=str, keep_default_na=False).items():
            rest = cells[~cells.isin(["nan", ""])]  # texts: a user may call something "nan"
            if (cells == "nan").any() and pd.to_numeric(rest, errors="coerce").notna().all():
                return f"{path.name}: nan in {name}"
    return ""


def answers(seed: int, count: int, *, long: bool = False) -> list[tuple[Case, str]]:
    """Commands that were answered badly, and how."""
    bad = []
    commands = (*COMMANDS, *LONG_COMMANDS) if long else COMMANDS
    for k in range(count):
        draw = np.random.default_rng([seed, k])
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            written(folder)
            case = spoilt(folder, draw, commands)
            wrong = fault(case[0], folder / "out")
        if wrong:
            bad.append((case, f"{k}: {wrong}"))
    return bad


def test_odd_inputs_are_answered_well():
    assert [f"{words}: {wrong}" for (words, _), wrong in answers(1, 200)] == []


@pytest.mark.slow
def test_more_odd_inputs_are_answered_well():
    assert [f"{words}: {wrong}" for (words, _), wrong in answers(2, 1800, long=True)] == []
