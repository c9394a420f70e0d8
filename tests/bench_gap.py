"""What `gap` costs against rows and against candidates, as ratios measured in one run."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import pipeline.identification.workflow.setup as setup_module
from pipeline.effects.registry import catalogue
from pipeline.identification.compare.circumstances import stages
from pipeline.identification.regression.design_matrix import make_data_sets
from pipeline.identification.regression.problem import Problem
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.evidence import State
from pipeline.identification.selection.pool import make_pool
from pipeline.identification.selection.search import Search
from pipeline.identification.workflow.compared import Compared, compare_logs, load_logs
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup, setup
from tests.leg_log import leg_logs

ROOT = Path(__file__).parents[1]
#: How often the log is repeated.
REPEATS = (4, 16, 64)
#: Share of the catalogue that competes.
SHARES = (0.25, 0.5, 1.0)


def gap_costs() -> None:
    """Print quality, where and prove per row, and what candidates cost."""
    log = leg_logs(5, ["viscous_friction"])["log_1"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.parquet"
        _rows(log, path)
        _candidates(log, path)


def _rows(log: dict[str, np.ndarray], path: Path) -> None:
    print("gap, one leg, log in chunks: CPU seconds and their ratio to the shortest log")
    shortest = setup_module.LONG_ROWS
    setup_module.LONG_ROWS = 0  # all of them in chunks, so that they compare
    first: tuple[int, float] | None = None
    try:
        for repeats in (1, *REPEATS):
            rows = _write(log, path, repeats)
            start = time.process_time()
            given, where = _where(path)
            models = [("as it was", given.model), ("again", given.model)]
            stages(models, where.measurements, where.loaded.long)
            spent = time.process_time() - start
            if repeats == 1:
                continue  # to warm up
            first = first or (rows, spent)
            more, longer = spent / first[1], rows / first[0]
            print(
                f"  {rows:8d} rows {spent:6.2f} s   {longer:5.1f} times the rows cost {more:5.2f}"
            )
    finally:
        setup_module.LONG_ROWS = shortest


def _candidates(log: dict[str, np.ndarray], path: Path) -> None:
    rows = _write(log, path, 1)
    given, where = _where(path)
    sigma = np.sqrt(np.mean([m.noise**2 for m in where.measurements], axis=0))
    effects = catalogue(given.model)
    print(
        f"naming, columns of all candidates and what each gains, {rows} rows: "
        "CPU seconds against candidates"
    )
    spent_on: list[tuple[int, float]] = []
    for share in (SHARES[0], *SHARES):  # once more to warm up
        some = effects[: max(1, round(share * len(effects)))]
        problem = Problem(given.model, make_data_sets(where.measurements), sigma)
        start = time.process_time()
        search = Search(make_pool(problem, some))
        search.gains(State((), UNCERTAINTIES[0]))
        spent_on.append((len(search.pool.terms), time.process_time() - start))
    fewest, least = spent_on[1]
    for count, spent in spent_on[1:]:
        more, many = spent / least, count / fewest
        print(
            f"  {count:4d} candidates {spent:6.2f} s   {many:5.1f} times as many cost {more:5.2f}"
        )


def _write(log: dict[str, np.ndarray], path: Path, repeats: int) -> int:
    clock = log["time_s"] - log["time_s"][0]
    table = {name: np.tile(values, repeats) for name, values in log.items()}
    starts = np.arange(repeats) * (clock[-1] + 2.0)
    table["time_s"] = (starts[:, None] + clock).ravel()
    pq.write_table(pa.table(table), path)
    return int(table["time_s"].size)


def _where(path: Path) -> tuple[Setup, Compared]:
    options = Options((path,), robot=ROOT / "urdf" / "leg.toml")
    given = setup(options)
    return given, compare_logs(given, given.model, *load_logs(given, options))
