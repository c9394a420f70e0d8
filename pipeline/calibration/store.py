"""The calibration's results: one file of numbers, and the calibrated values in their own files.

Everything is prepared first and then moved into place, so that an interrupted calibration leaves
the old files as they were.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from actuators.build import CATALOG
from actuators.units import from_si
from pipeline.calibration.errors import CalibrationError
from pipeline.calibration.machine import POSTURE, ROBOT
from pipeline.calibration.prior import Free, Prior, load_prior

RESULTS_FILE = Path(__file__).parent / "results" / "calibration.json"
_DIGITS = 9
#: Ensemble spread over prior spread above which the targets tell nothing of a number.
FREE_ABOVE = 0.85
#: Coordinates this close to a bound count as lying at it.
AT_BOUND = 0.02
_SOURCE = "nearest to the prior among all sets that meet the paper's figures"


@dataclass(frozen=True)
class Calibrated:
    """One number after calibration, SI.

    Attributes:
        key: ``robot.<name>`` or ``<component>.<name>``.
        unit: As its file writes it.
        prior: Centre before.
        prior_interval: 95 % belief before.
        value: At the nearest point.
        low: 2.5 % quantile over the ensemble.
        high: 97.5 % quantile.
        spread: Ensemble over prior standard deviation.
        verdict: ``determined``, ``narrowed`` or ``not determined``.
        at_bound: ``lower``, ``upper`` or empty.
    """

    key: str
    unit: str
    prior: float
    prior_interval: tuple[float, float]
    value: float
    low: float
    high: float
    spread: float
    verdict: str
    at_bound: str


def calibrated_numbers(results: dict[str, Any], prior: Prior) -> list[Calibrated]:
    """What the calibration says of every free number."""
    best = np.array(results["nearest"]["z"])
    members = np.array([m["z"] for m in results["ensemble"]])
    out = []
    for i, free in enumerate(prior.free):
        low, high = (free.value(float(q)) for q in np.quantile(members[:, i], [0.025, 0.975]))
        value = free.value(float(best[i]))
        spread = float(members[:, i].std())
        verdict = "determined" if spread < 0.3 else "narrowed"
        if spread >= FREE_ABOVE * _prior_spread(free):
            verdict = "not determined"
        bound = ""
        if best[i] - free.coordinate(free.bounds[0]) < AT_BOUND:
            bound = "lower"
        elif free.coordinate(free.bounds[1]) - best[i] < AT_BOUND:
            bound = "upper"
        out.append(
            Calibrated(
                free.key,
                free.unit,
                free.centre,
                free.interval,
                value,
                min(low, value),
                max(high, value),
                spread,
                verdict,
                bound,
            )
        )
    return out


def _prior_spread(free: Free) -> float:
    """Standard deviation of the unit Gaussian cut off at the number's bounds."""
    from scipy.stats import truncnorm

    low, high = (free.coordinate(bound) for bound in free.bounds)
    return float(truncnorm.std(low, high))


def save(results: dict[str, Any], robot: Path, catalog: Path = CATALOG) -> list[Path]:
    """Write the results and the calibrated values, all or nothing.

    Args:
        results: From `pipeline.calibration.calibrate.calibrate`.
        robot: Robot file whose numbers are replaced; comments and order stay.
        catalog: Folder of the component files.

    Returns:
        The files written.
    """
    numbers = calibrated_numbers(results, load_prior())
    documents = {robot: tomlkit.parse(robot.read_text(encoding="utf-8"))}
    for number in numbers:
        component, name = number.key.split(".")
        path = robot if component == ROBOT else catalog / f"{component}.toml"
        if path not in documents:
            documents[path] = tomlkit.parse(path.read_text(encoding="utf-8"))
        reason = f"{number.verdict} by them" + (
            f"; at its {number.at_bound} bound" if number.at_bound else ""
        )
        _replace(documents[path], name, number.value, number.low, number.high, reason)
    _posture(documents[robot], results)
    _splits(documents, catalog, results, {n.key: n.value for n in numbers})
    documents[robot]["gait"]["transfer_path"] = results["nearest"]["path"]
    contents = {path: tomlkit.dumps(document) for path, document in documents.items()}
    contents[RESULTS_FILE] = json.dumps(_rounded(results), separators=(",", ":")) + "\n"
    temporary = {path: path.with_name(f".{path.name}.{os.getpid()}.tmp") for path in contents}
    try:
        for path, text in contents.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary[path].write_text(text, encoding="utf-8")
        for path in contents:
            os.replace(temporary[path], path)
    finally:
        for leftover in temporary.values():
            leftover.unlink(missing_ok=True)
    return list(contents)


def _replace(
    document: tomlkit.TOMLDocument, name: str, value: float, low: float, high: float, reason: str
) -> None:
    entry: Any = document["parameters"][name]
    unit = str(entry["unit"])
    written = [float(f"{from_si(x, unit):.8g}") for x in (value, low, high)]
    entry["value"] = written[0]
    entry["basis"] = "calibrated"
    entry["source"] = _SOURCE
    entry["reason"] = reason
    entry["interval"] = [min(written), max(written)]


def _posture(document: tomlkit.TOMLDocument, results: dict[str, Any]) -> None:
    """Numbers solved from section II.C and Table III."""
    rows = ("the reaction of 192.6 N", "joint 2 in Table III", "joint 3 in Table III")
    for name, row in zip(POSTURE, rows, strict=True):
        spread = [m["posture"][name] for m in results["ensemble"]]
        low, high = (float(q) for q in np.quantile(spread, [0.025, 0.975]))
        value = results["nearest"]["posture"][name]
        reason = f"solved from {row}"
        _replace(document, name, value, min(low, value), max(high, value), reason)


def _splits(
    documents: dict[Path, Any], catalog: Path, results: dict[str, Any], values: dict[str, float]
) -> None:
    """The second ratio of each pair follows from the first and the published 400."""
    requirement = tomlkit.parse((catalog / "requirement.toml").read_text(encoding="utf-8"))
    total = float(requirement["parameters"]["ratio"]["value"])
    for first, second in (("harmonic_drive", "timing_belt"), ("planetary", "hypoid")):
        path = catalog / f"{second}.toml"
        if path not in documents:
            documents[path] = tomlkit.parse(path.read_text(encoding="utf-8"))
        own = documents[catalog / f"{first}.toml"]["parameters"]["ratio"]
        entry = documents[path]["parameters"]["ratio"]
        low, high = own["interval"]
        entry["value"] = total / float(own["value"])
        entry["interval"] = [
            float(f"{total / float(high):.8g}"),
            float(f"{total / float(low):.8g}"),
        ]
        entry["basis"] = "derived"
        entry["source"] = f"{total:g} over the ratio of {first}"
        entry["reason"] = ""


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


def results_hash(path: Path = RESULTS_FILE) -> str:
    """SHA-256 of the stored results."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
