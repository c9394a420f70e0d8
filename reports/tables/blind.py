"""Tables of the blind trials: trials, written names, rates, effects that were hidden alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from pipeline.column import column
from reports.table import Table, table_of


@dataclass(frozen=True)
class TrialRow:
    """One blind trial."""

    table: ClassVar = "trials"
    about: ClassVar = "Every blind trial, judged."
    source: str = column("of the machine: own or mujoco")
    seed: float = column("of everything drawn", "1")
    trial: float = column("number", "1")
    kind: str = column("empty, single, several or outside the catalogue")
    machine: str = column("pendulum, leg, arm or walk")
    joints: float = column("of the machine", "1")
    bodies_off: float = column("largest error of the URDF's bodies", "1")
    background_friction: str = column(
        "whether all joints have friction in addition to what is hidden"
    )
    motions: str = column("of the training log and of the test log")
    rate_Hz: float = column("of the logs", "Hz")
    encoder_bits: float = column("of the joints' encoders", "1")
    positions: str = column("measured at joints, motors or both")
    hidden: str = column("effects hidden, empty for none; several by semicolons")
    hidden_place: str = column("where")
    hidden_values: str = column("parameters in SI units")
    z: float = column("standard deviations in the log, of the weakest", "sd")
    visible: str = column("whether the log could show all that is hidden")
    alike: str = column("names that this log cannot tell from it")
    exit_code: float = column("0 explained, 1 a part unexplained; 2 refused, -1 no answer", "1")
    cpu_s: float = column("of the answer", "s")
    written: float = column("names in the model file", "1")
    found: str = column("for every hidden effect whether it is named and written")
    all_found: str = column("whether all are")
    wrong: str = column("written and not in the machine")
    wrong_confirmed: str = column("of them, those that are confirmed")
    message: str = column("of gap, where it gave no answer")


@dataclass(frozen=True)
class NameRow:
    """One written name."""

    table: ClassVar = "names"
    about: ClassVar = "Every written name, judged."
    source: str = column("of the machine")
    trial: float = column("number", "1")
    kind: str = column("of the trial")
    machine: str = column("of the trial")
    effect: str = column("in the catalogue's words")
    place: str = column("where")
    level: str = column("confirmed or approximate")
    rivals: str = column("names that the answer calls indistinguishable from it")
    values: str = column("parameters with 95 % intervals, SI")
    verdict: str = column("right, class (right as one of a class), wrong, flexible (no name)")
    why: str = column("what it is right by, or what the machine lacks")
    intervals: float = column("parameters that were hidden", "1")
    intervals_that_cover: float = column("of them, those whose interval holds the truth", "1")
    mass_ratio: float = column("of a payload: found over true", "1")
    mass_inside: str = column("of a payload: within 5 % or inside its interval")


@dataclass(frozen=True)
class RateRow:
    """How often the workflow was right."""

    table: ClassVar = "rates"
    about: ClassVar = "How often the workflow was right, with Wilson's intervals."
    source: str = column("own, mujoco, or all")
    rate: str = column("name")
    meaning: str = column("of which trials which share")
    hits: float = column("how many", "1")
    count: float = column("out of how many", "1")
    share: float = column("hits over count", "1")
    low: float = column("lower end of Wilson's 95 % interval", "1")
    high: float = column("upper end", "1")
    aim_low: float = column("what is aimed at: at least; empty where nothing is", "1")
    aim_high: float = column("at most", "1")
    reached: str = column("whether the share lies inside the aim")


@dataclass(frozen=True)
class EffectRow:
    """How an effect fared alone."""

    table: ClassVar = "by_effect"
    about: ClassVar = "How each effect fared that was hidden alone."
    effect: str = column("hidden alone")
    source: str = column("of the machine")
    trials: float = column("with it alone", "1")
    visible: float = column("of them, those whose log could show it", "1")
    found: float = column("named and written, or its class", "1")
    unexplained: float = column("called unexplained", "1")
    wrong: float = column("trials with a wrong name written", "1")
    wrong_confirmed: float = column("trials with a wrong name confirmed", "1")


def blind_table(kind: Any, rows: Sequence[Mapping[str, Any]]) -> Table:
    """A table of rows that are mappings from header to value."""
    return table_of(kind, [kind(**row) for row in rows])
