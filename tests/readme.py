"""The pages' generated tables and pictures: `make readme`. A test holds the tables current."""

from __future__ import annotations

import csv
import re
import shutil
import sys
import tempfile
import textwrap
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
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
    from pipeline.api.judgement import judged
    from pipeline.cli.main import parser
    from pipeline.cli.options import settings_of
    from pipeline.paper.judgement.basis import basis
    from reports.pages.summary_words import first_paragraph

    given = settings_of(
        parser().parse_args(["reports", "--robot", str(ROOT / "urdf/hexapod.toml")])
    )
    by = basis(given)
    if isinstance(by, str) or by.results is None:
        raise ValueError(f"the calibration does not belong to the files: {by}")
    text = first_paragraph(judged(given, by)[0])
    return "\n".join(textwrap.wrap(text, 110, break_on_hyphens=False, break_long_words=False))


def _written(unit: str) -> str:
    """A unit as pages write it."""
    return "that of the channel" if unit == "channel" else unit.replace("*", "·").replace("^2", "²")


def effects(out: Path) -> str:
    """Every effect with its parameters, from the catalogue."""
    from pipeline.effects.base import Effect
    from pipeline.effects.registry import EFFECTS

    def name(effect: Effect) -> str:
        special = ", ".join(f"`{word}`" for word in effect.contains)
        return f"`{effect.name}`" + (f", contains {special}" if special else "")

    def parameters(effect: Effect) -> str:
        units: dict[str, str] = {}
        for p in effect.parameters:  # knots of a curve are told once
            name, _, number = p.name.rpartition("_")
            units[f"{name}_k" if number.isdigit() else p.name] = _written(p.unit)
        return ", ".join(f"`{n}`" + (f" [{u}]" if u != "1" else "") for n, u in units.items())

    text = table(
        ("effect", "acts at", "parameters", "is shown by a motion that"),
        [(name(e), e.place_kind, parameters(e), e.excitation) for e in EFFECTS.values()],
    )
    return text.replace("---:", "---")


def share(hits: str, trials: str) -> str:
    """A count out of another."""
    return f"{hits} of {trials}"


def percentage(text: str) -> str:
    """One decimal."""
    return f"{100 * float(text):.1f}"


def aim(row: dict[str, str]) -> str:
    """What is aimed at, empty where nothing is."""
    low, high = row["aim_low"], row["aim_high"]
    if not low:
        return ""
    if float(high) == 1.0:
        return f"≥ {100 * float(low):.0f} %"
    if float(low) == 0.0:
        return f"≤ {100 * float(high):.0f} %"
    return f"{100 * float(low):.0f} to {100 * float(high):.0f} %"


def blind(out: Path) -> str:
    """Rates of the blind trials, from the stored run; a sentence where none is stored."""
    if not (PICTURES / BLIND[0]).exists():
        return "No run is stored yet."
    found = [r for r in rows(PICTURES, "blind_rates") if r["count"] != "0"]
    sources = list(dict.fromkeys(r["source"] for r in found))
    lines = []
    for name in dict.fromkeys(r["rate"] for r in found):
        own = {r["source"]: r for r in found if r["rate"] == name}
        first = next(iter(own.values()))
        cells = [
            f"{share(own[s]['hits'], own[s]['count'])}, {percentage(own[s]['share'])} % "
            f"({percentage(own[s]['low'])} to {percentage(own[s]['high'])})"
            if s in own
            else ""
            for s in sources
        ]
        lines.append((first["meaning"], *cells, aim(first) if first["aim_low"] else ""))
    count = len(rows(PICTURES, "blind_trials"))
    return table((f"{count} trials", *sources, "aim"), lines)


def blind_effects(out: Path) -> str:
    """How each effect fared that was hidden alone, from the stored run."""
    if not (PICTURES / BLIND[0]).exists():
        return "No run is stored yet."
    columns = ("found", "unexplained", "wrong", "wrong_confirmed")
    lines = [
        (f"`{r['effect']}`", r["source"], *(share(r[name], r["trials"]) for name in columns))
        for r in rows(PICTURES, "blind_by_effect")
    ]
    header = ("named and written", "called unexplained", "wrong written", "wrong confirmed")
    return table(("hidden alone", "source", *header), lines)


def force_rules(out: Path) -> str:
    """What the rules of the ground's forces cost the hexapod on its gait."""
    import pipeline as lw

    walk = lw.walk(lw.load(ROOT / "urdf/hexapod.toml"), samples=151, compare_forces=True)
    costs = walk.table("walking_force_rules").frame().set_index(["alternative", "rule"])
    paper = "least_tangential"
    lines = []
    for name in costs.index.unique(0):
        energy, friction = costs.electrical_J[name], costs.greatest_friction_needed[name]
        others = ("least_torque", "least_power")
        change = [f"{100 * (energy[rule] / energy[paper] - 1):+.1f} %" for rule in others]
        needed = [f"{friction[rule]:.2g}" for rule in (paper, *others)]
        lines.append((str(name), number(str(energy[paper])), *change, ", ".join(needed)))
    return table(
        ("actuator", "least tangential [J]", "least torque", "least power", "friction needed"),
        lines,
    )


#: Block -> the page it stands on, and what makes it; some need a run, some the code alone.
BLOCKS: dict[str, tuple[str, Callable[[Path], str]]] = {
    "standing": ("README.md", standing),
    "walking": ("README.md", walking),
    "force rules": ("pipeline/dynamics/README.md", force_rules),
    "parameters": ("pipeline/paper/README.md", parameters),
    "agreement": ("pipeline/paper/README.md", agreement),
    "effects": ("pipeline/effects/README.md", effects),
    "blind": ("pipeline/blind/README.md", blind),
    "blind effects": ("pipeline/blind/README.md", blind_effects),
}
OF_BLIND = ("blind", "blind effects")
WITHOUT_RUN = {"agreement", "effects", "force rules", *OF_BLIND}
PAGES = tuple(dict.fromkeys(page for page, _ in BLOCKS.values()))
#: What a run of `make blind` leaves that its page shows, as it is called where it is stored.
BLIND = tuple(f"blind_{name}.csv" for name in ("trials", "rates", "by_effect", "names"))


def renewed(page: str, text: str, out: Path, names: Collection[str] = tuple(BLOCKS)) -> str:
    """A page with its blocks between their markers made anew from a run's files.

    Args:
        page: Relative to the root.
        text: Of the page.
        out: Folder of the run.
        names: Blocks to renew.

    Raises:
        ValueError: A block's markers are missing or doubled.
    """
    for name, (own, make) in BLOCKS.items():
        if own != page or name not in names:
            continue
        begin, end = f"<!-- begin: {name} -->", f"<!-- end: {name} -->"
        pattern = re.compile(re.escape(begin) + r".*?" + re.escape(end), re.S)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f"{page}: '{begin}' and '{end}' must stand once")
        block = f"{begin}\n{make(out)}\n{end}"
        text = pattern.sub(lambda _, block=block: block, text)
    return text


def renew(out: Path, names: Collection[str]) -> None:
    """Write the pages that have blocks of these names."""
    for page in dict.fromkeys(BLOCKS[name][0] for name in names):
        path = ROOT / page
        text = path.read_text(encoding="utf-8")
        path.write_text(renewed(page, text, out, names), encoding="utf-8")
        print(f"renewed {page}")


def store_blind(folder: Path) -> int:
    """Take over the tables of a run of `make blind`, renew their page.

    Args:
        folder: Of that run.
    """
    for name in BLIND:
        shutil.copyfile(folder / name.removeprefix("blind_"), PICTURES / name)
    renew(folder, OF_BLIND)
    return 0


def draw_pictures() -> None:
    """The figures that pages show, as PNG."""
    import pipeline as lw
    from pipeline.api.figures import drawings
    from pipeline.api.pictures.scene import Scene
    from pipeline.simulation.walk_stand import stand, walk
    from reports.figures.save import save_png

    given = lw.load(ROOT / "urdf/hexapod.toml").walking()
    chains = given.chains()
    every = drawings(
        Scene(given.robot), given, stand(given.machine, chains), walk(given.machine, chains)
    )
    for name in SHOWN:
        save_png(every[Path(name).stem](), PICTURES / name)


def main(words: Sequence[str]) -> int:
    """Run, renew tables and pictures; only the named tables where names are given.

    Args:
        words: Names of blocks (all of them, and the pictures, by default), or `--blind DIR` to take
            over the run of blind trials in DIR.
    """
    if words[:1] == ["--blind"]:
        return store_blind(Path(words[1]))
    from pipeline.cli.main import main as command

    if unknown := set(words) - set(BLOCKS):
        print(f"no block {', '.join(sorted(unknown))}; known: {', '.join(BLOCKS)}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        if not words or set(words) - WITHOUT_RUN:
            robot = str(ROOT / "urdf/hexapod.toml")
            if code := command(["reports", "--robot", robot, "--out", str(out)]):
                return code
        renew(out, words or tuple(BLOCKS))
        if not words:
            draw_pictures()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
