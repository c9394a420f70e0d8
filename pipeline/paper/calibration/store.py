"""The calibration's results: one file of numbers, and the calibrated values in their own files.

Everything is prepared first and then moved into place, so that an interrupted calibration leaves
the old files as they were.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from actuators.loading.build import CATALOG, load_catalog
from actuators.units import from_si
from pipeline.paper.calibration.fingerprint import Fingerprint, fingerprint
from pipeline.paper.calibration.prior import Prior, load_prior
from pipeline.paper.constants.motor_constants import KEYS, UNITS
from pipeline.paper.errors import CalibrationError
from pipeline.paper.hexapod import POSTURE, ROBOT, SPLITS
from pipeline.paper.published import load_published
from pipeline.robot.robot_file import load_robot_file
from reports.atomic import replacing

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
    """One number after calibration, SI.

    Attributes:
        key: ``robot.<name>`` or ``<component>.<name>``.
        unit: As its file writes it.
        value: At the nearest point.
        low: 2.5 % quantile of the posterior, or the value where that is less.
        high: 97.5 % quantile of the posterior, or the value where that is greater.
        verdict: One of `VERDICTS`.
        r_hat: How well groups of walkers agree on it: 1 where they do [1].
        effective: Effective number of independent draws behind these numbers.
        prior: Centre before; None for the motor's constants, which Tables IV to VI fix.
        prior_interval: 95 % belief before; None likewise.
        shift: Mean of the posterior less the prior's centre, in prior standard deviations.
        spread: Standard deviation of the posterior, in prior standard deviations.
        at_lower: Share of the posterior at the lower bound [1].
        at_upper: Share of the posterior at the upper bound [1].
    """

    key: str
    unit: str
    value: float
    low: float
    high: float
    verdict: str
    r_hat: float
    effective: float
    prior: float | None = None
    prior_interval: tuple[float, float] | None = None
    shift: float | None = None
    spread: float | None = None
    at_lower: float = 0.0
    at_upper: float = 0.0

    @property
    def at_bound(self) -> float:
        """Share of the posterior at either bound [1]."""
        return self.at_lower + self.at_upper

    @property
    def bound(self) -> str:
        """The bound near which most of it lies: ``lower``, ``upper``, or empty for none."""
        if self.at_bound == 0:
            return ""
        return "lower" if self.at_lower > self.at_upper else "upper"


def calibrated_numbers(results: Mapping[str, Any], prior: Prior) -> list[Calibrated]:
    """What the calibration says of every free number and of the motor's constants."""
    known, nearest = results["posterior"]["numbers"], results["nearest"]
    out = []
    for free, coordinate in zip(prior.free, nearest["z"], strict=True):
        own = known[free.key]
        low, high, value = (free.value(float(q)) for q in (own["low"], own["high"], coordinate))
        shift, spread = own["mean"], own["spread"]
        out.append(
            Calibrated(
                *(free.key, free.unit, value, min(low, value), max(high, value)),
                number_verdict(shift, spread, free.spread),
                *(own["r_hat"], own["effective"], free.centre, free.interval),
                *(shift, spread, own["at_lower"], own["at_upper"]),
            )
        )
    for key in KEYS:
        own, value = known[key], nearest["constants"][key]
        low, high = min(own["low"], value), max(own["high"], value)
        out.append(
            Calibrated(key, UNITS[key], value, low, high, FIXED, own["r_hat"], own["effective"])
        )
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

    Args:
        results: From `pipeline.paper.calibration.calibrate.calibrate`.
        robot: Robot file whose numbers are replaced; comments and order stay.
        catalog: Folder of the component files.

    Returns:
        The files written.
    """
    components = [path for path in catalog.glob("*.toml") if path.stem != "alternatives"]
    before = {path: path.read_text(encoding="utf-8") for path in (robot, *components)}
    documents = {path: tomlkit.parse(text) for path, text in before.items()}
    _fill_in(documents, results, robot, catalog)
    texts = {path: tomlkit.dumps(document) for path, document in documents.items()}
    texts = {path: text for path, text in texts.items() if text != before[path] or path == robot}
    with replacing(*texts, RESULTS_FILE) as (*temporary, results_file):
        staged = dict(zip(texts, temporary, strict=True))
        for path, text in texts.items():
            staged[path].write_text(text, encoding="utf-8")
        results["numbers"] = _fingerprint_of(staged, robot, catalog)
        text = json.dumps(_rounded(results), separators=(",", ":"))
        results_file.write_text(text + "\n", encoding="utf-8")
    return [*texts, RESULTS_FILE]


def _fingerprint_of(staged: Mapping[Path, Path], robot: Path, catalog: Path) -> Fingerprint:
    """The numbers of the files as they are about to be."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path in catalog.glob("*.toml"):
            shutil.copyfile(staged.get(path, path), folder / path.name)
        spec = load_robot_file(staged[robot])
        return fingerprint(spec, load_catalog(folder), load_published(), load_prior())


def _fill_in(
    documents: Mapping[Path, Any], results: Mapping[str, Any], robot: Path, catalog: Path
) -> None:
    """Put every calibrated number into its file."""
    for number in calibrated_numbers(results, load_prior()):
        component, name = number.key.split(".")
        path = robot if component == ROBOT else catalog / f"{component}.toml"
        reason = _REASONS[number.verdict] + (
            f"; at its {number.bound} bound in {100 * number.at_bound:.0f} % of the posterior"
            if number.at_bound >= AT_LEAST
            else ""
        )
        entry = documents[path]["parameters"][name]
        _replace(entry, number.value, number.low, number.high, reason)
        if number.verdict == FIXED:
            entry["source"] = _FIXED_SOURCE
    nearest = results["nearest"]
    rows = ("the reaction of 192.6 N", "joint 2 in Table III", "joint 3 in Table III")
    for name, row in zip(POSTURE, rows, strict=True):
        spread = [m["posture"][name] for m in results["sets"]]
        low, high = (float(q) for q in np.quantile(spread, [0.025, 0.975]))
        value, entry = nearest["posture"][name], documents[robot]["parameters"][name]
        _replace(entry, value, min(low, value), max(high, value), f"solved from {row}")
    total = float(documents[catalog / "requirement.toml"]["parameters"]["ratio"]["value"])
    for free, following in SPLITS.items():
        first, second = (
            documents[catalog / f"{reference.split('.')[0]}.toml"]["parameters"]["ratio"]
            for reference in (free, following)
        )
        low, high = first["interval"]
        second["value"] = total / float(first["value"])
        second["interval"] = [float(f"{total / float(end):.8g}") for end in (high, low)]
        second["basis"] = "derived"
        second["source"] = f"{total:g} over the ratio of {free.split('.')[0]}"
        second["reason"] = ""
    documents[robot]["gait"]["transfer_path"] = nearest["path"]


def _replace(entry: Any, value: float, low: float, high: float, reason: str) -> None:
    """Put a calibrated number, SI, into its table."""
    unit = str(entry["unit"])
    written = [float(f"{from_si(x, unit):.8g}") for x in (value, low, high)]
    entry["value"] = written[0]
    entry["basis"] = "calibrated"
    entry["source"] = _SOURCE
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
