"""The calibration's results: one file of numbers, and the calibrated values in their own files.

`fingerprint` says which numbers a calibration was made with: it judges no others.
"""

from __future__ import annotations

import json
import math
import shutil
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import tomlkit

from actuators.loading.build import CATALOG, Catalog, load_catalog
from actuators.units import dimension, from_si, to_si
from pipeline.atomic import replacing
from pipeline.column import column
from pipeline.errors import CalibrationError
from pipeline.paper.calibration.prior import Prior, load_prior
from pipeline.paper.hexapod import POSTURE, ROBOT, SPLITS
from pipeline.paper.motor_constants import UNITS
from pipeline.paper.published import Published, load_published
from pipeline.robot.robot_file import RobotSpec, load_robot_file

Fingerprint = Mapping[str, float | str]
#: Stored numbers have nine digits.
_SAME = 1e-8
RESULTS_FILE = Path(__file__).parent / "results" / "calibration.json"
_DIGITS = 9
#: Standard deviation of the posterior, in the prior's, below which a number counts as known.
DETERMINED_BELOW = 0.3
#: Posterior spread over prior spread above which the targets say nothing of a number.
FREE_ABOVE = 0.85
#: Shift of the posterior's mean, in the prior's standard deviations, that is worth a word.
MOVED_ABOVE = 0.5
#: Beyond this many standard deviations a number has left the prior's 95 % belief.
BELIEF = 1.96
#: Share of the posterior at a bound that is worth a word.
AT_LEAST = 0.05
FIXED = "fixed by Tables IV to VI"
#: What the targets did to a number.
VERDICTS = {
    "determined": f"posterior narrower than {DETERMINED_BELOW:g} prior standard deviations",
    "narrowed": f"narrower than the prior, its mean within {MOVED_ABOVE:g} of the prior's centre",
    "moved": f"its mean more than {MOVED_ABOVE:g} prior standard deviations from the centre",
    "against the prior": "its mean outside what the prior believes at 95 %",
    "not determined": "as wide as the prior and where the prior is",
    FIXED: "one of all motor constants that give these tables",
}
#: The same as the reason of a number whose source is what the sets meet.
_REASONS = {verdict: f"{verdict} by them" for verdict in VERDICTS} | {
    "against the prior": "driven out of the prior's 95 % by them",
    FIXED: "no data sheet resolves what these tables leave",
}
_SOURCE = "nearest to the prior among all sets that meet the paper's figures"
_FIXED_SOURCE = "middle of all motor constants that give Tables IV to VI as printed"


@dataclass(frozen=True)
class Calibrated:
    """Every free number before and after."""

    table: ClassVar = "calibration"
    parameter: str = column("robot or component, and name in its file")
    unit: str = column("unit of the numbers")
    prior: float | None = column(
        "centre of prior knowledge; empty where there was none", "see unit"
    )
    prior_low: float | None = column("lower end of the 95 % belief", "see unit")
    prior_high: float | None = column("upper end of the 95 % belief", "see unit")
    calibrated: float = column("at the set nearest to the prior", "see unit")
    low: float = column(
        "2.5 % quantile of the posterior, or the calibrated number where that is less", "see unit"
    )
    high: float = column(
        "97.5 % quantile of the posterior, or the calibrated number where that is greater",
        "see unit",
    )
    shift_over_prior: float | None = column(
        "mean of the posterior less the prior's centre, in prior standard deviations", "1"
    )
    spread_over_prior: float | None = column(
        "standard deviation of the posterior, in prior standard deviations", "1"
    )
    at_lower_share: float = column("share of the posterior at the number's lower bound", "1")
    at_upper_share: float = column("share of the posterior at the number's upper bound", "1")
    verdict: str = column("; ".join(f"{v}: {meaning}" for v, meaning in VERDICTS.items()))
    r_hat: float = column("nested R-hat of groups of walkers; 1 where they agree", "1")
    effective_sample_size: float = column("independent draws that say as much", "1")

    @property
    def at_bound(self) -> float:
        """Share of the posterior at either bound [1]."""
        return self.at_lower_share + self.at_upper_share

    @property
    def bound(self) -> str:
        """The bound near which most of it lies: ``lower``, ``upper``, or empty for none."""
        if self.at_bound == 0:
            return ""
        return "lower" if self.at_lower_share > self.at_upper_share else "upper"


_COLUMNS = [own.name for own in fields(Calibrated)]


def calibrated_numbers(results: Mapping[str, Any], prior: Prior) -> list[Calibrated]:
    """What the calibration says of every free number and of the motor's constants."""
    nearest = results["nearest"]
    after = dict(zip(prior.keys, nearest["z"], strict=True)) | nearest["constants"]
    free = {f.key: f for f in prior.free}
    out = []
    for key, own in results["posterior"]["numbers"].items():
        before: tuple[float, ...] = ()
        moved: tuple[float | None, ...] = (None, None, 0.0, 0.0)
        numbers = [after[key], own["low"], own["high"]]
        if key in free:
            unit, before = free[key].unit, (free[key].centre, *free[key].interval)
            numbers = [free[key].value(z) for z in numbers]
            moved = (own["mean"], own["spread"], own["at_lower"], own["at_upper"])
            verdict = number_verdict(own["mean"], own["spread"], free[key].spread)
        else:
            unit, verdict = UNITS[key], FIXED
        ends = (numbers[0], min(numbers), max(numbers))
        shown = [from_si(x, unit) for x in (*before, *ends)]
        cells = [*[None] * (6 - len(shown)), *shown, *moved]
        row = (key, unit, *cells, verdict, own["r_hat"], own["effective"])
        out.append(Calibrated(**dict(zip(_COLUMNS, row, strict=True))))
    return out


def number_verdict(shift: float, spread: float, prior_spread: float) -> str:
    """What the targets did to a number, one of `VERDICTS`.

    Args:
        shift: Mean of the posterior, in prior standard deviations from the prior's centre.
        spread: Standard deviation of the posterior, in the same.
        prior_spread: Standard deviation of the prior itself, cut off at the bounds, in the same.
    """
    if abs(shift) > BELIEF:
        return "against the prior"
    if spread < DETERMINED_BELOW:
        return "determined"
    if abs(shift) > MOVED_ABOVE:
        return "moved"
    return "not determined" if spread >= FREE_ABOVE * prior_spread else "narrowed"


def save(results: dict[str, Any], robot: Path, catalog: Path = CATALOG) -> list[Path]:
    """Write the results and the calibrated values, all or nothing.

    Everything is prepared first and then moved into place, so that an interrupted calibration
    leaves the old files as they were.

    Args:
        results: From `pipeline.paper.calibration.calibrate.calibrate`.
        robot: Robot file whose numbers are replaced; comments and order stay.
        catalog: Folder of the component files.

    Returns:
        The files written.
    """
    components = [path for path in catalog.glob("*.toml") if path.stem != "alternatives"]
    before = {path: path.read_text(encoding="utf-8") for path in (robot, *components)}
    owners = {robot: ROBOT} | {path: path.stem for path in components}
    documents = {owners[path]: tomlkit.parse(text) for path, text in before.items()}
    _fill_in(documents, results)
    texts = {path: tomlkit.dumps(documents[owner]) for path, owner in owners.items()}
    texts = {path: text for path, text in texts.items() if text != before[path] or path == robot}
    with ExitStack() as stack:
        staged = {p: stack.enter_context(replacing(p)) for p in (*texts, RESULTS_FILE)}
        for path, text in texts.items():
            staged[path].write_text(text, encoding="utf-8")
        with tempfile.TemporaryDirectory() as name:  # the catalogue as it is about to be
            for path in catalog.glob("*.toml"):
                shutil.copyfile(staged.get(path, path), Path(name) / path.name)
            after, spec = load_catalog(name), load_robot_file(staged[robot])
            results["numbers"] = fingerprint(spec, after, load_published(), load_prior())
        text = json.dumps(_rounded(results), separators=(",", ":"))
        staged[RESULTS_FILE].write_text(text + "\n", encoding="utf-8")
    return [*texts, RESULTS_FILE]


def _fill_in(documents: Mapping[str, Any], results: Mapping[str, Any]) -> None:
    """Put every calibrated number into its file, by the robot or the component."""
    parameters = {name: document.get("parameters") for name, document in documents.items()}
    for number in calibrated_numbers(results, load_prior()):
        component, name = number.parameter.split(".")
        reason = _REASONS[number.verdict] + (
            f"; at its {number.bound} bound in {100 * number.at_bound:.0f} % of the posterior"
            if number.at_bound >= AT_LEAST
            else ""
        )
        ends = [to_si(x, number.unit) for x in (number.calibrated, number.low, number.high)]
        source = _FIXED_SOURCE if number.verdict == FIXED else _SOURCE
        _replace(parameters[component][name], ends, source, reason)
    nearest = results["nearest"]
    rows = ("the reaction of 192.6 N", "joint 2 in Table III", "joint 3 in Table III")
    for name, row in zip(POSTURE, rows, strict=True):
        spread = np.quantile([m["posture"][name] for m in results["sets"]], [0.025, 0.975])
        value = nearest["posture"][name]
        ends = [value, min(spread[0], value), max(spread[1], value)]
        _replace(parameters[ROBOT][name], ends, _SOURCE, f"solved from {row}")
    total = float(parameters["requirement"]["ratio"]["value"])
    for free, following in SPLITS.items():
        names = [reference.split(".")[0] for reference in (free, following)]
        first, second = (parameters[name]["ratio"] for name in names)
        low, high = first["interval"]
        second["value"] = total / float(first["value"])
        second["interval"] = [float(f"{total / float(end):.8g}") for end in (high, low)]
        second["basis"] = "derived"
        second["source"] = f"{total:g} over the ratio of {names[0]}"
        second["reason"] = ""
    documents[ROBOT]["gait"]["transfer_path"] = nearest["path"]


def _replace(entry: Any, ends: list[float], source: str, reason: str) -> None:
    """Put a calibrated number into its table: value, low and high, SI."""
    unit = str(entry["unit"])
    written = [float(f"{from_si(float(x), unit):.8g}") for x in ends]
    entry["value"] = written[0]
    entry["basis"] = "calibrated"
    entry["source"] = source
    entry["reason"] = reason
    entry["interval"] = [min(written), max(written)]


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(entry) for entry in value]
    return value


def load_results(path: Path = RESULTS_FILE) -> dict[str, Any]:
    """Read the stored results.

    Raises:
        CalibrationError: Missing or damaged.
    """
    try:
        results: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        raise CalibrationError(
            f"{path.name}: no calibration results; run `make calibrate`"
        ) from None
    return results


def fingerprint(
    spec: RobotSpec, catalog: Catalog, published: Mapping[str, Published], prior: Prior
) -> Fingerprint:
    """Everything a judgement depends on, by name: SI numbers and texts."""
    out: dict[str, float | str] = {f"robot.{name}": x for name, x in spec.parameters.items()}
    out |= {f"gait.{key}": _text(value) for key, value in sorted(spec.gait.items())}
    out["standing.feet"] = repr(spec.standing_feet)
    out["legs"] = repr([(leg.name, leg.joints, leg.foot, leg.side) for leg in spec.legs])
    # No law takes a part's mass.
    parts = [(component, p) for component, p in catalog.rows() if dimension(p.unit) != "mass"]
    out |= {f"{component}.{p.name}": p.value for component, p in parts}
    for name, a in catalog.alternatives.items():
        elements = [(e.name, e.law, e.stage, sorted(e.arguments.items())) for e in a.elements]
        out[f"alternatives.{name}"] = repr((a.motor, a.ratio, elements))
    for p in published.values():
        out[f"published.{p.id}"] = repr((p.unit, p.value, p.half_width, p.role))
    for f in prior.free:
        out[f"prior.{f.key}"] = repr((f.centre, f.deviation, f.bounds, f.logarithmic))
    return out


def _text(value: object) -> str:
    if isinstance(value, list):
        return repr(tuple(tuple(v) if isinstance(v, list) else v for v in value))
    return value if isinstance(value, str) else repr(value)


def differences(stored: Fingerprint, now: Fingerprint) -> list[str]:
    """Names under which two fingerprints differ, in order; empty where they are the same."""
    return [name for name in {**now, **stored} if not _same(stored.get(name), now.get(name))]


def _same(a: float | str | None, b: float | str | None) -> bool:
    if isinstance(a, str) or isinstance(b, str) or a is None or b is None:
        return a == b
    return math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12)
