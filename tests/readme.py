"""The README's tables and pictures from a run: `make readme`. A test holds the tables current."""

from __future__ import annotations

import csv
import re
import shutil
import sys
import tempfile
import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PICTURES = ROOT / "reports" / "example"
SHOWN = ("robot.png", "electrical_energy.png")
LEG = "rm"
#: What the paper prints, for the last column. Tables IV to VI and sections IV.B and V.
PRINTED_STANDING = {"ideal": "6.14", "rotor": "5.58", "reversible": "2.60", "irreversible": "0"}
PRINTED_RATIO = {
    "ideal": "1",
    "rotor": "4",
    "reversible": "more than 10",
    "irreversible": "almost 15",
}


def rows(out: Path, name: str) -> list[dict[str, str]]:
    """A table of a run."""
    with (out / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A Markdown table, numbers to the right."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, rule, *lines))


def number(text: str, scale: float = 1.0) -> str:
    """Three significant digits, no minus zero."""
    value = float(text) * scale
    if value == 0:
        return "0"
    shown = f"{value:#.3g}".rstrip(".")
    # A residue of rounding is nothing to show.
    return "0" if abs(value) < 1e-9 else shown


def standing(out: Path) -> str:
    """Joint 2 of the middle right leg while standing, Tables IV to VI."""
    energy = {(r["alternative"], r["leg"]): r["energy_J"] for r in rows(out, "standing_energy")}
    return table(
        ("actuator", "motor torque [mN·m]", "current [A]", "voltage [V]", "power [W]")
        + ("leg, 3 s [J]", "paper [J]"),
        [
            (
                r["alternative"],
                number(r["motor_torque_Nm"], 1e3),
                *(number(r[c]) for c in ("current_A", "voltage_V", "power_W")),
                number(energy[r["alternative"], LEG]),
                PRINTED_STANDING[r["alternative"]],
            )
            for r in rows(out, "standing")
            if r["joint"] == f"{LEG}_joint_2"
        ],
    )


def walking(out: Path) -> str:
    """Electrical energy of one cycle."""
    robot = {r["alternative"]: r for r in rows(out, "robot_energy")}
    return table(
        ("actuator", "leg, one cycle [J]", "ratio to ideal", "paper", "robot [W]")
        + ("cost of transport", "share of support"),
        [
            (
                r["alternative"],
                number(r["electrical_J"]),
                number(r["ratio_to_ideal"]),
                PRINTED_RATIO[r["alternative"]],
                number(robot[r["alternative"]]["average_power_W"]),
                number(robot[r["alternative"]]["cost_of_transport"]),
                f"{100 * float(robot[r['alternative']]['support_share']):.0f} %",
            )
            for r in rows(out, "walking_energy")
            if r["leg"] == LEG
        ],
    )


def parameters(out: Path) -> str:
    """How many numbers rest on what."""
    count = Counter(r["basis"] for r in rows(out, "parameters"))
    meaning = {
        "published": "printed in the paper",
        "datasheet": "a manufacturer's",
        "derived": "follows from others, formula stated",
        "calibrated": "fitted to the paper's numbers, with an interval",
        "identified": "from a measured log, with an interval",
        "assumed": "with a reason and an interval",
    }
    return table(
        ("basis", "numbers", "what it means"),
        [(basis, str(count[basis]), text) for basis, text in meaning.items() if count[basis]],
    ).replace("| --- | ---: | ---: |", "| --- | ---: | --- |")


def agreement(out: Path) -> str:
    """What is fitted, predicted and contradicted: the first paragraph of `summary.md`."""
    from pipeline.app.cli import parser
    from pipeline.app.judgement import basis, judged
    from pipeline.app.settings import settings
    from pipeline.app.summary_words import first_paragraph

    given = settings(parser().parse_args(["reports", "--robot", str(ROOT / "urdf/hexapod.toml")]))
    by = basis(given)
    if isinstance(by, str) or by.results is None:
        raise ValueError(f"the calibration does not belong to the files: {by}")
    text = first_paragraph(judged(given, by)[0])
    return "\n".join(textwrap.wrap(text, 110, break_on_hyphens=False, break_long_words=False))


BLOCKS = {
    "standing": standing,
    "walking": walking,
    "parameters": parameters,
    "agreement": agreement,
}


def renewed(text: str, out: Path) -> str:
    """The README with every block between its markers made anew from a run's files.

    Raises:
        ValueError: A block's markers are missing or doubled.
    """
    for name, make in BLOCKS.items():
        begin, end = f"<!-- begin: {name} -->", f"<!-- end: {name} -->"
        pattern = re.compile(re.escape(begin) + r".*?" + re.escape(end), re.S)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f"README.md: '{begin}' and '{end}' must stand once")
        block = f"{begin}\n{make(out)}\n{end}"
        text = pattern.sub(lambda _, block=block: block, text)
    return text


def main() -> int:
    """Run, renew the tables and pictures."""
    from pipeline.app.cli import main as command

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        code = command(["reports", "--robot", str(ROOT / "urdf/hexapod.toml"), "--out", str(out)])
        if code:
            return code
        text = README.read_text(encoding="utf-8")
        README.write_text(renewed(text, out), encoding="utf-8")
        PICTURES.mkdir(exist_ok=True)
        for name in SHOWN:
            shutil.copyfile(out / name, PICTURES / name)
    print(f"renewed {README.name} and {len(SHOWN)} pictures")
    return 0


if __name__ == "__main__":
    sys.exit(main())
