"""One page and one CSV of two runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from pipeline.api.diff.compare import PARAMETERS, Comparison, Pair, compare
from pipeline.api.diff.runs import read_run
from pipeline.api.result import own_names
from pipeline.column import column
from pipeline.errors import ReportError
from reports.folder import staged
from reports.forms import write_pages
from reports.page import Block, FigureBlock, Page, Section, TableBlock
from reports.table import header_words, table_of
from reports.typeset import plain, unit_text
from reports.writer import write_table

#: Of the table and its files.
NAME = "side_by_side"
#: Tables that a reader looks for first, as far as both runs have them.
FIRST = ("robot_energy", "walking_energy", "standing_energy", "bodies", "where", "found")
#: Rows of a table that the page shows; the CSV has all.
SHOWN = 12
#: Inputs that the first lines name.
TOLD = 4
#: Change of a number, over the largest of its column, that is rounding's.
ROUNDING = 1e-9
ABOUT = "Every number of every table that both runs have; B against A."


@dataclass(frozen=True)
class SideBySide:
    """One number of two runs."""

    table: str = column("CSV that both runs have")
    row: str = column("what names the row in it")
    quantity: str = column("its column")
    unit: str = column("of a, b and difference")
    a: float = column("value of run A; empty where it has none", "see unit")
    b: float = column("value of run B; empty where it has none", "see unit")
    difference: float = column("b less a", "see unit")
    ratio: float = column("b over a; empty where a is zero", "1")


def write_diff(first: Path, second: Path, out: Path, decimal: str = ".") -> list[str]:
    """Write the page and the CSV.

    Args:
        first: Folder of run A.
        second: Folder of run B.
        out: Folder to write.
        decimal: As for `write_table`.

    Returns:
        Lines for a terminal.

    Raises:
        ReportError: A folder holds no run, the runs cannot be compared, or `out` cannot be written.
    """
    both = compare(read_run(first), read_run(second))
    if out.resolve() in {first.resolve(), second.resolve()}:
        raise ReportError(f"{out}: holds a run that is compared; name another folder with --out")
    table = table_of(SideBySide, both.pairs, name=NAME, about=ABOUT, exact=True)
    with staged(out, "diff", decimal=decimal) as folder:
        write_table(table, folder, meta=_meta(both), decimal=decimal)
        for side, run in (("a", both.a), ("b", both.b)):
            for name in both.figures:
                (folder / side).mkdir(exist_ok=True)
                (folder / side / name).write_bytes((run.folder / name).read_bytes())
        write_pages(page(both, folder), folder)
    return [*map(plain, answer(both)), f"written to {out}"]


def _meta(both: Comparison) -> dict[str, object]:
    """What the sidecar says: both runs, each as its own sidecars do."""
    keys = ("inputs_sha256", "options", "versions")
    return {
        side: {"verb": run.verb, **{k: run.meta[k] for k in keys if k in run.meta}}
        for side, run in (("run_a", both.a), ("run_b", both.b))
    }


def answer(both: Comparison) -> list[str]:
    """The first lines: which runs, what went in, what came out."""
    names = own_names([both.a.folder, both.b.folder])
    runs = zip("AB", names, (both.a, both.b), strict=True)
    out = ["; ".join(f"**{x}** is `{name}` (a run of `{run.verb}`)" for x, name, run in runs) + "."]
    changed = [p for p in both.table(PARAMETERS) if differs(p)]
    went = [f"{what} ({x}; {y})" for what, x, y in both.inputs]
    went = [*went[:TOLD], f"{len(went) - TOLD} more below"] if len(went) > TOLD + 1 else went
    went += (
        [f"{len(changed)} number{'s' * (len(changed) > 1)} of parameters.csv"] if changed else []
    )
    out.append(f"**What went in** differs in: {'; '.join(went) or 'nothing that the runs state'}.")
    results = [p for p in both.pairs if p.table != PARAMETERS]
    shared = [p for p in results if p.both]
    alone = len(results) - len(shared)
    text = f"**What came out:** {sum(map(differs, shared))} of {len(shared)} numbers"
    text += f" that both have differ; {alone} stand in one alone." if alone else " differ."
    for name in FIRST:
        pairs = [p for p in both.table(name) if p.both and p.unit != "1"]
        if pairs:
            head = pairs[0].quantity
            own = [p for p in pairs if p.quantity == head][:4]
            meaning = both.a.tables[name].meanings[head]
            parts = [f"{p.row} {p.a:.4g} and {p.b:.4g}{_unit(p)}{_ratio(p)}" for p in own]
            text += f" {meaning[0].upper()}{meaning[1:]}, A and B: {'; '.join(parts)}."
            break
    out.append(text)
    out += [
        f"**Note:** {name} of {x} is not as its run wrote it."
        for x, run in (("A", both.a), ("B", both.b))
        for name in run.changed
    ]
    return out


def differs(pair: Pair) -> bool:
    """Whether a number is another, or there in one run alone."""
    return pair.weight > ROUNDING or not pair.both


def _unit(pair: Pair) -> str:
    return "" if pair.unit in ("", "1") else f" {unit_text(pair.unit)}"


def _ratio(pair: Pair) -> str:
    return f" (× {pair.ratio:.3g})" if pair.ratio == pair.ratio else ""


def page(both: Comparison, folder: Path) -> Page:
    """The page; the figures must lie in the folder already."""
    sections = [Section("What went in", _went_in(both))]
    names = [n for n in both.a.tables if n in both.b.tables and n != PARAMETERS]
    order = sorted(names, key=lambda n: FIRST.index(n) if n in FIRST else len(FIRST))
    shown = {name: _shown(both, name) for name in order}
    same = [name for name in order if not any(map(differs, both.table(name)))]
    alone = [name for name in order if not shown[name] and name not in same]
    blocks = [_block(both, name, pairs) for name, pairs in shown.items() if pairs]
    last = *_same(same, "The same in both"), *_same(alone, f"No row in common, see `{NAME}.csv`")
    sections.append(Section("What came out", (*blocks, *last)))
    pairs = [
        FigureBlock(folder / side / name, words, half=True)
        for name in both.figures
        for side, words in (("a", f"A: {Path(name).stem.replace('_', ' ')}"), ("b", "B"))
    ]
    own = {x: [n for n, y in both.alone.items() if y == x] for x in "AB"}
    rest = [f"In {x} alone: {', '.join(names)}." for x, names in own.items() if names]
    sections.append(Section("Figures", (*pairs, *rest)))
    first, second = own_names([both.a.folder, both.b.folder])
    return Page(
        f"Two runs side by side: A is {first}, B is {second}",
        tuple(answer(both)),
        tuple(sections),
        {f"{NAME}.csv": "every number of both runs with difference and ratio"},
        f"legwatt {version('legwatt')}. Read from the CSVs of both runs; nothing is computed anew.",
    )


def _went_in(both: Comparison) -> tuple[Block, ...]:
    blocks: list[Block] = []
    if both.inputs:
        caption = "Files, options and versions that differ, by the sidecars of the runs."
        blocks.append(TableBlock(("what", "A", "B"), both.inputs, caption))
    if any(map(differs, both.table(PARAMETERS))):
        blocks.append(_block(both, PARAMETERS, _shown(both, PARAMETERS)))
    return tuple(blocks) or ("Nothing that the runs state differs.",)


def _same(names: Sequence[str], text: str) -> tuple[Block, ...]:
    return (f"{text}: {', '.join(names)}.",) if names else ()


def _shown(both: Comparison, name: str) -> list[Pair]:
    """The numbers of a table that differ most, and what one run has alone where that is little."""
    apart = [pair for pair in both.table(name) if differs(pair)]
    alone = [pair for pair in apart if not pair.both]
    most = sorted((p for p in apart if p.both), key=lambda pair: -pair.weight)[:SHOWN]
    most += alone if len(alone) <= SHOWN else []
    return [pair for pair in apart if pair in most]


def _block(both: Comparison, name: str, pairs: Sequence[Pair]) -> TableBlock:
    rows = tuple(
        (
            f"{p.row}: {header_words(p.quantity, p.unit)}"
            + (f" [{unit_text(p.unit)}]" if _unit(p) else ""),
            *(x if x == x else None for x in (p.a, p.b, p.difference, p.ratio)),
        )
        for p in pairs
    )
    every = both.table(name)
    shared, apart = (sum(p.both and (differs(p) or k) for p in every) for k in (True, False))
    which = "those that differ most" if apart > SHOWN else "all that differ"
    caption = f"`{name}`: {which} of {shared} numbers that both have"
    caption += f"; {len(every) - shared} stand in one run alone." if len(every) > shared else "."
    return TableBlock(("what", "A", "B", "B − A", "B / A"), rows, caption, f"{NAME}.csv")
