"""Judges the run against the paper where the run is the calibrated default."""

from __future__ import annotations

from pathlib import Path

from pipeline.app.settings import Settings
from pipeline.calibration.judge import Judgement, judge, leave_one_out, reading_rows
from pipeline.calibration.judge import sensitivity_rows as sensitivities_of
from pipeline.calibration.prior import load_prior
from pipeline.calibration.store import RESULTS_FILE, calibrated_numbers, load_results
from reports.table import Table
from reports.tables import judgement as tables


def applies(given: Settings) -> bool:
    """Whether the stored ensemble belongs to this run: the calibrated robot, nothing changed."""
    return (
        RESULTS_FILE.exists()
        and not given.changes
        and given.effects is None
        and given.actuators is None
        and not given.quasi_static
        and given.regeneration.policy == "none"
        and given.robot.spec.path.name == load_results().get("robot")
    )


def judged(given: Settings) -> tuple[Judgement, list[Table]]:
    """Everything held against the paper.

    Raises:
        CalibrationError: There are no stored results.
    """
    results = load_results()
    judgement = judge(given.robot, given.catalog, results, samples=given.samples)
    prior = load_prior()
    return judgement, [
        tables.reproduction(judgement.reproduction),
        tables.conclusions(judgement.conclusions),
        tables.readings(reading_rows(results)),
        tables.leave_one_out(leave_one_out(results)),
        tables.calibration(calibrated_numbers(results, prior)),
        tables.sensitivities(sensitivities_of(results)),
        tables.break_even(judgement.break_even),
        tables.energy_per_minute(judgement.per_minute),
    ]


def pages(given: Settings, judgement: Judgement, every: list[Table], out: Path) -> int:
    """Fig. 21 for every subject, then the summary that shows all figures.

    Returns:
        How many figures and pages.
    """
    from pipeline.app.figures import write_fig_21
    from pipeline.app.summary import write_summary

    titles = {name: a.title.split(": ")[-1] for name, a in given.catalog.alternatives.items()}
    count = write_fig_21(judgement, titles, out)
    results = load_results()
    numbers = calibrated_numbers(results, load_prior())
    return count + write_summary(given, judgement, numbers, every, results, out)
