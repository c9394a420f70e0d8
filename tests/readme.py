"""The pages' generated tables and pictures: `make readme`. A test holds the tables current."""

import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import pandas as pd

import pipeline as lw
from pipeline.columns import about, every_table
from pipeline.commands.main import main as command
from reports.figures.style import house_style
from reports.run import drawings

ROOT = Path(__file__).parents[1]
HEXAPOD = str(ROOT / "urdf" / "hexapod.toml")
PICTURES = ("robot", "electrical_energy")
#: What the paper prints: energy of a leg that stands for 3 s, and of one that walks over ideal.
PRINTED = {
    "ideal": ("6.14", "1"),
    "rotor": ("5.58", "4"),
    "reversible": ("2.60", "more than 10"),
    "irreversible": ("0", "almost 15"),
}


def read(out: Path, name: str, **where: str) -> pd.DataFrame:
    """Rows of a table of a run that have these texts, its cells as texts."""
    found = pd.read_csv(out / f"{name}.csv", dtype=str, keep_default_na=False)
    return found[(found[[*where]] == [*where.values()]).all(axis=1)].set_index("alternative")


def markdown(header: Sequence[str], lines: Iterable[Sequence[str]], rest: str = "---:") -> str:
    """A Markdown table, numbers to the right."""
    rule = ["---", *[rest] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, rule, *lines))


def number(text: str, scale: float = 1.0) -> str:
    """Three significant digits; a residue of rounding is nothing to show."""
    value = float(text) * scale
    return "0" if abs(value) < 1e-9 else f"{value:#.3g}".rstrip(".")


def standing(out: Path) -> str:
    """Joint 2 of the middle right leg while standing, Tables IV to VI."""
    joint = read(out, "standing", joint="rm_joint_2")
    energy = read(out, "standing_energy", leg="rm")["energy_J"].map(number)
    torque = joint["motor_torque_Nm"].map(lambda text: number(text, 1e3))
    rest = [joint[name].map(number) for name in ("current_A", "voltage_V", "power_W")]
    lines = zip(joint.index, torque, *rest, energy, (x for x, _ in PRINTED.values()), strict=True)
    units = ("motor torque [mN·m]", "current [A]", "voltage [V]", "power [W]")
    return markdown(("actuator", *units, "leg, 3 s [J]", "paper [J]"), lines)


def walking(out: Path) -> str:
    """Electrical energy of one cycle."""
    leg, robot = read(out, "walking_energy", leg="rm"), read(out, "robot_energy")
    own = [leg[name].map(number) for name in ("electrical_J", "ratio_to_ideal")]
    whole = [robot[name].map(number) for name in ("average_power_W", "cost_of_transport")]
    share = (f"{100 * float(text):.0f} %" for text in robot["support_share"])
    lines = zip(leg.index, *own, (x for _, x in PRINTED.values()), *whole, share, strict=True)
    header = ("actuator", "leg, one cycle [J]", "ratio to ideal", "paper", "robot [W]")
    return markdown((*header, "cost of transport", "share of support"), lines)


def tables(out: Path) -> str:
    """Every table that a run may leave, from where its columns are declared."""
    lines = ((f"`{name}.csv`", about(name)) for name in every_table())
    return markdown(("file", "holds"), lines, "---")


#: Block -> the page it stands on, and what makes it from the folder of a run.
BLOCKS: dict[str, tuple[str, Callable[[Path], str]]] = {
    "standing": ("README.md", standing),
    "walking": ("README.md", walking),
    "tables": ("reports/tables/README.md", tables),
}


def renewed(name: str, text: str, out: Path) -> str:
    """A page with one block between its markers made anew from a run's folder."""
    begin, end = f"<!-- begin: {name} -->", f"<!-- end: {name} -->"
    before, _, rest = text.partition(begin)
    _, found, after = rest.partition(end)
    if not found:
        raise ValueError(f"{BLOCKS[name][0]}: '{begin}' and '{end}' must stand there")
    return f"{before}{begin}\n{BLOCKS[name][1](out)}\n{end}{after}"


def draw_pictures() -> None:
    """The figures that the README shows, as PNG."""
    given = lw.load(HEXAPOD).walking()
    done = lw.stand(given), lw.walk(given)
    tables = done[0].tables | done[1].tables
    every = drawings(given, done[0].result, done[1].result, tables)
    for name in PICTURES:
        path = ROOT / "reports" / "example" / f"{name}.png"
        with house_style():
            every[name]().savefig(path, metadata={"Software": None})


def main(names: Sequence[str]) -> int:
    """Run, renew the tables and the pictures; only tables of these names where some are given."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        if code := command(["reports", "--robot", HEXAPOD, "--out", folder]):
            return code
        for name in names or BLOCKS:
            path = ROOT / BLOCKS[name][0]
            text = renewed(name, path.read_text(encoding="utf-8"), out)
            path.write_text(text, encoding="utf-8")
        if not names:
            draw_pictures()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
