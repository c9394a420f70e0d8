"""Tables of the gap workflow: quality, where, candidates, found, and the motion that decides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.table import Meaning, Table, table_from_rows

Rows = Sequence[Mapping[str, Any]]
Array = NDArray[np.float64]

QUALITY = {
    "log": ("name of the log", ""),
    "column": ("header in the log format; empty for the log as a whole", ""),
    "check": ("what was looked at", ""),
    "value": ("what was found", "see unit"),
    "unit": ("unit of value", ""),
    "verdict": ("ok, masked (rows left out), warning or refused", ""),
    "detail": ("in words, with the remedy where there is one", ""),
}
WHERE: dict[str, Meaning] = {
    "rank": ("1 is the largest part of the gap above the noise floor", "1"),
    "joint": ("name of the joint", ""),
    "by": ("what the rows are sorted by", ""),
    "band": ("which of them", ""),
    "rows": ("rows compared", "1"),
    "gap": ("root mean square of measured minus predicted", "see unit"),
    "mean": ("mean of measured minus predicted", "see unit"),
    "noise_floor": ("standard deviation of the sensor's noise in the same bandwidth", "see unit"),
    "unit": ("unit of gap, mean and noise_floor", ""),
    "share_of_total": ("share of the squared gap of all joints", "1", "share of all"),
    "share_above_noise": ("of it, beyond the squared noise floor", "1", "of it above noise"),
}
CANDIDATES = {
    "effect": ("name in the catalogue of effects", ""),
    "joint": ("joint it acts at; empty where it acts on all", ""),
    "place": ("joints, link or ground it acts on", ""),
    "validation_before": ("gap without it on rows that choose, by the others", "see unit"),
    "validation_after": ("the same with it; empty where it was not tried in earnest", "see unit"),
    "unit": ("unit of both", ""),
    "identifiable": ("whether this motion could show it", ""),
    "verdict": ("accepted, rejected, not identifiable on this motion, indistinguishable from", ""),
    "reason": ("in words", ""),
}
FOUND: dict[str, Meaning] = {
    "order": ("in which it was accepted; one row per parameter", "1", "no."),
    "effect": ("name in the catalogue of effects", ""),
    "law": ("which of the effect's laws; empty where it has but one", ""),
    "amounts_to": ("effects of one term each that the law is the sum of, joined by +", ""),
    "joint": ("joint it acts at; empty where it acts on all", ""),
    "place": ("joints, link, column or ground it acts on, joined by +", ""),
    "parameter": ("of the effect", ""),
    "value": ("best estimate", "see unit"),
    "ci_low": ("lower end of the 95 % interval", "see unit", "95 % from"),
    "ci_high": ("upper end of the 95 % interval", "see unit", "to"),
    "unit": ("unit of value and interval", ""),
    "gap_before": (
        "gap without it, held-out data, root mean square; empty without rows",
        "see gap_unit",
    ),
    "gap_after": ("the same with it", "see gap_unit"),
    "gap_unit": ("unit of both gaps and the noise floor", ""),
    "noise_floor": ("of the joints it acts on", "see gap_unit"),
    "level": ("confirmed, approximate (both written) or suspected (not written)", ""),
    "share": (
        "of draws of the log's blocks in which it wins; empty where none were drawn",
        "1",
        "share of draws",
    ),
    "reason": ("why it is not confirmed; empty where it is", ""),
    "written": ("whether model.toml holds it; one that it leaves out: gap beside the file's", ""),
}

BASE_PARAMETERS: dict[str, Meaning] = {
    "name": ("combination of bodies' parameters that the motion tells", "", "base parameter"),
    "urdf": ("its value by the URDF", "see unit", "URDF"),
    "value": ("fitted", "see unit", "fitted"),
    "low": ("lower end of the 95 % interval", "see unit", "95 % from"),
    "high": ("upper end of the 95 % interval", "see unit", "to"),
    "unit": ("of the four", ""),
    "far": ("fitted less URDF, per the URDF's uncertainty as validation chose it", "1"),
}

_BODY = {"mass_kg": "mass", **{f"center_{axis}_m": f"centre of mass, {axis}" for axis in "xyz"}}
BODIES: dict[str, Meaning] = {
    "link": ("with all that is fixed to it", ""),
    **{
        f"{head}{name}": (f"{what}{tail}", name.rpartition("_")[2])
        for name, what in _BODY.items()
        for head, tail in (
            ("urdf_", " by the URDF, in the link's frame"),
            ("found_", " as found"),
            ("low_", ": lower end of the 95 % interval; empty where there is none"),
            ("high_", ": upper end of the 95 % interval; empty where there is none"),
        )
    },
    "differs_in": ("where the URDF's value lies outside the interval, joined by +", ""),
}


def quality(rows: Rows) -> Table:
    """The judgement on the logs."""
    return table_from_rows("quality", rows, QUALITY, "What the logs are worth, check by check.")


def where(rows: Rows) -> Table:
    """Where model and machine disagree, ranked."""
    return table_from_rows(
        "where", rows, WHERE, "Measured less predicted, by joint and circumstance; ranked."
    )


def candidates(rows: Rows) -> Table:
    """Every candidate once."""
    return table_from_rows(
        "candidates", rows, CANDIDATES, "Every effect at every place that was tried."
    )


def found(rows: Rows) -> Table:
    """Accepted effects."""
    return table_from_rows("found", rows, FOUND, "What the model lacked.")


def base_parameters(rows: Rows) -> Table:
    """What a log tells of the bodies, beside the URDF."""
    return table_from_rows(
        "base_parameters", rows, BASE_PARAMETERS, "Base parameters of the bodies: URDF and log."
    )


def bodies(rows: Rows) -> Table:
    """Bodies by the URDF and as found."""
    return table_from_rows(
        "bodies", rows, BODIES, "Bodies by the URDF and as found, the largest change first."
    )


def deciding_motion(time: Array, joints: Sequence[str], position: Array) -> Table:
    """A trajectory in the columns of a log.

    Args:
        time: Shape (N,) [s].
        joints: Names of the columns.
        position: Shape (N, J) [rad].
    """
    columns: dict[str, Any] = {"time_s": time}
    meanings = {"time_s": ("time", "s")}
    for k, joint in enumerate(joints):
        columns[f"{joint}__position_rad"] = position[:, k]
        meanings[f"{joint}__position_rad"] = (f"target of {joint}", "rad")
    return Table(
        "deciding_motion",
        columns,
        meanings,
        "Motion inside the robot's limits that tells the indistinguishable effects apart.",
    )
