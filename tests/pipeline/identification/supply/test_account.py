"""The supply's power against the sum over the drives: signs, balance, samples, terms."""

import html
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

import pipeline as lw
from actuators.errors import LegwattError
from pipeline.identification.supply.account import MEASURED, UNEXPLAINED, account, rows_of
from pipeline.identification.supply.drives import DrivePower, supply_samples
from pipeline.identification.supply.fit import OWN, TERMS, Fit
from pipeline.identification.workflow.compared import load_logs
from pipeline.logs.log import Recording, column_name
from tests.blind.machines.supply import make_supply
from tests.command_line import as_compared, exit_code
from tests.command_line import rows_of as table_rows

Array = NDArray[np.float64]
HEXAPOD = Path("urdf/hexapod.toml")
#: Of the trials whose rates the README states.
SEED, TRIALS = 202, 20
#: Terms that may stand in the answer beside what is hidden: windings of a leg that rubs carry more.
BESIDE = {"extra_friction": {"more_copper", "more_friction", "drivers"}}


def walk_log(folder: Path, *, efforts: bool, rubbed: float | None = None) -> Path:
    """Ten cycles of the shipped walk by `reversible`, with means of its supply's power, 5 W more.

    Four means a second. `rubbed`: torques, not currents, of joints that rub with so many N·m.
    """
    walked = lw.walk(lw.load(HEXAPOD), "reversible").result
    result, supply = walked.results["reversible"], walked.supplies["reversible"]
    time, rate, every = result.joint.time, 200.0, 50
    t = np.arange(round(rate * 10 * time[-1])) / rate

    def along(x: Array) -> Array:
        return np.stack([np.interp(t % time[-1], time, own) for own in x.T], axis=1)

    joint, columns = result.joint, {"time_s": t}
    series = {"position_rad": joint.position, "velocity_rad_s": joint.velocity}
    if rubbed is not None:
        series |= {"torque_Nm": joint.torque + rubbed * np.sign(joint.velocity)}
    series |= {"current_A": result.current} if efforts else {}
    for name, values in series.items():
        columns |= {f"{j}__{name}": x for j, x in zip(joint.joints, along(values).T, strict=True)}
    supplied = along(np.maximum(supply.electrical, 0.0)).sum(axis=1)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (supplied[1:] + supplied[:-1]))])
    power = np.full(supplied.size, np.nan)
    power[every::every] = np.diff(total[::every]) / every + 5.0
    pd.DataFrame(columns | {"supply__power_W": power}).to_parquet(folder / "walk.parquet")
    return folder / "walk.parquet"


@pytest.mark.parametrize(("efforts", "near"), [(True, 0.01), (False, 0.05)])
def test_log_of_a_chain_draws_what_the_chain_draws(tmp_path, efforts, near):
    """The sum over the drives equals the chain's own supply, by the log's torque or the model's."""
    log = walk_log(tmp_path, efforts=efforts)
    asked, given = as_compared(log, step="power", robot=HEXAPOD, alternative="reversible")
    told = account(given, load_logs(given, asked).logs, 0, None)
    rows, samples = told.power.set_index("term"), told.samples
    mean = samples["measured_W"].mean()
    assert len(told.by_model) == (0 if efforts else 18)
    assert samples["model_W"].mean() == pytest.approx(mean - 5.0, rel=near)
    assert rows.loc[MEASURED, "mean_W"] == mean  # of all samples, and so are the terms
    terms = rows.drop([MEASURED, UNEXPLAINED])["mean_W"].sum()
    assert samples["explained_W"].mean() == pytest.approx(terms)
    assert not told.wrong_sum
    assert 0.0 < told.drives["copper_W"].sum() < samples["model_W"].mean()
    if efforts:
        assert np.corrcoef(samples["model_W"], samples["measured_W"])[0, 1] > 0.99
        assert abs(rows.loc[UNEXPLAINED, "mean_W"]) < 0.01 * mean
        assert rows.loc["constant", "mean_W"] == pytest.approx(5.0, abs=0.2)
        assert not told.negative


def test_friction_of_a_walk_is_no_work_of_its_bodies(tmp_path):
    """Feet at rest and a closed cycle on level ground: bodies take nothing on the whole."""
    log = walk_log(tmp_path, efforts=False, rubbed=3.0)
    asked, given = as_compared(log, step="power", robot=HEXAPOD, alternative="ideal")
    told = account(given, load_logs(given, asked).logs, 0, None)
    rows, columns = told.power.set_index("term"), pd.read_parquet(log)
    speed = columns.filter(like="velocity_rad_s").abs().to_numpy()
    friction = 3.0 * speed.sum(axis=1).mean()
    assert abs(rows.loc["work", "mean_W"]) < 0.05 * friction
    assert rows.loc["friction", "mean_W"] == pytest.approx(friction, rel=0.05)


def drives(time: Array, work: Array, **parts: Array) -> DrivePower:
    zero = np.zeros_like(work)
    own = {"work": work, "friction": zero, "copper": zero, **parts}
    step, known = float(time[1] - time[0]), np.ones(time.size, dtype=np.bool_)
    return DrivePower(time, zero, own, zero, known, step, reach=step, by_model=())


def samples_until(end: Array) -> pd.DataFrame:
    return pd.DataFrame({"begin": end - 1.0, "end": end, "power": 11.0, "voltage": np.nan})


def test_power_that_returns_is_no_part_of_what_is_drawn():
    """A drive that brakes draws nothing; what it gives back is negative and counts by its share."""
    time = np.linspace(0.0, 2.0, 201)
    work = np.stack([np.full(201, 10.0), np.full(201, -6.0)], axis=1)
    copper = np.stack([np.full(201, 1.0), np.full(201, 2.0)], axis=1)
    samples = samples_until(np.array([1.0, 2.0]))
    rows = rows_of(drives(time, work, copper=copper), samples, {}, "mean")
    expected = {"work": 10.0, "copper": 1.0, "returned": -4.0, "drivers": 11.0}
    for name, value in expected.items():
        assert rows[name].to_numpy() == pytest.approx([value, value])


def test_sample_over_a_gap_is_left_out_and_others_are_exact_means():
    known = np.concatenate([np.arange(101), np.arange(150, 401)])
    time = np.asarray(0.01 * known, dtype=np.float64)
    work = (1.0 + time)[:, None]
    samples = samples_until(np.array([1.0, 2.0, 3.0, 4.0]))
    rows = rows_of(drives(time, work), samples, {}, "mean")
    assert rows["end"].tolist() == [1.0, 3.0, 4.0]
    assert rows["work"].to_numpy() == pytest.approx([1.5, 3.5, 4.5])


def log_with(**columns: Any) -> Recording:
    frame = {column_name("supply", quantity): values for quantity, values in columns.items()}
    table = pd.DataFrame(frame)
    table["time_s"] = 0.01 * np.arange(len(table))
    return Recording("made", table, ("a",), "torque")


def test_sparse_and_held_columns_give_the_same_samples():
    rng = np.random.default_rng(1)
    values = 24.0 + rng.random(30)
    sparse = np.full(3000, np.nan)
    sparse[::100] = values
    held = np.repeat(values, 100)
    volts = np.full(3000, 24.0)
    one, other = (
        supply_samples(log_with(supply=volts, supply_current=x), 0.1) for x in (sparse, held)
    )
    assert one["end"].to_numpy() == pytest.approx(other["end"])
    assert one["power"].to_numpy() == pytest.approx(24.0 * values[1:])
    assert other["power"].to_numpy() == pytest.approx(24.0 * values[1:])


NOTHING = np.full(200, np.nan)
BAD: dict[str, tuple[dict[str, Array], str]] = {
    "no column": ({}, "no column of the supply"),
    "a current alone": ({"supply_current": np.ones(200)}, "supply__voltage_V"),
    "a voltage alone": ({"supply": np.ones(200)}, "supply__current_A"),
    "negative voltage": ({"supply": -np.ones(200), "supply_current": np.ones(200)}, "positive"),
    "dead meter": ({"supply_power": np.full(200, 48.0)}, "dead sensor"),
    "power the other way": ({"supply_power": np.linspace(-2.0, -1.0, 200)}, "flip"),
}


@pytest.mark.parametrize("case", BAD)
def test_supply_that_is_none_is_refused_in_one_line(case):
    columns, told = BAD[case]
    with pytest.raises(LegwattError, match=told) as error:
        supply_samples(log_with(**columns) if columns else log_with(base_roll=NOTHING), 0.1)
    assert "\n" not in str(error.value)


def fit_of(seed: int, coefficients: dict[str, float]) -> Fit:
    """240 samples of independent terms and noise of 1 W, with the terms that are chosen."""
    rng = np.random.default_rng(seed)
    rows = pd.DataFrame({name: rng.uniform(5.0, 15.0, 240) for name in (*OWN, *TERMS)})
    rows["constant"], rows["returned"] = 1.0, -rows["returned"]
    rows["power"] = rows[[*OWN]].sum(axis=1) + rng.standard_normal(240)
    for name, c in coefficients.items():
        rows["power"] += c * rows[name]
    block = np.arange(240) // 10
    bare = Fit(rows, block, block % 4 == 3)
    return replace(bare, terms=bare.chosen())


def test_nothing_hidden_nothing_named():
    assert sum(bool(fit_of(seed, {}).terms) for seed in range(40)) <= 2


@pytest.mark.parametrize(
    ("name", "coefficient", "named"),
    [
        ("constant", 20.0, True),
        ("drivers", 0.2, True),
        ("returned", 0.7, True),
        ("more_copper", -0.4, True),
        ("drivers", 0.02, False),  # lessens an error of 1 W by less than .002 W: see `LITTLE`
    ],
)
def test_hidden_term_is_found_with_its_coefficient(name, coefficient, named):
    fit = fit_of(7, {name: coefficient})
    assert fit.terms == (name,) * named
    if named:
        assert fit.coefficients(~fit.test)[0] == pytest.approx(coefficient, rel=0.1)
        assert fit.exchangeable(name) == []


def test_terms_that_cannot_be_told_apart_are_told_together():
    """Losses in proportion to a power that never changes are a constant, whatever it is called."""
    fit = fit_of(4, {"constant": 18.0})
    fit.rows["drivers"] = 30.0
    (named,) = fit.chosen()
    assert {named, *replace(fit, terms=(named,)).exchangeable(named)} == {"constant", "drivers"}


@pytest.mark.usefixtures("sketched")
@pytest.mark.parametrize(
    ("hidden", "code", "said"),
    [(("constant", "drivers"), 0, "constant"), (("wrong_sum",), 1, "no power at the supply")],
)
def test_command_says_the_answer_and_writes_it(tmp_path, capsys, hidden, code, said):
    """On a log of a hexapod between whose battery and motors something is hidden."""
    options = make_supply(5, 0, tmp_path / "trial", hidden)["options"]
    given = ("log.", "urdf/", "mapping.")
    words = [str(tmp_path / "trial" / "given" / x) if x.startswith(given) else x for x in options]
    assert exit_code(["gap", *words, "--out", str(tmp_path / "out")]) == code
    assert said in capsys.readouterr().out
    assert {"index.html", "power_in_time.svg"} <= {p.name for p in (tmp_path / "out").iterdir()}
    assert "gives, by log 'log'" in html.unescape((tmp_path / "out" / "index.html").read_text())
    terms = [row["term"] for row in table_rows(tmp_path / "out" / "power.csv")]
    # No term means anything in what is no power: none is listed.
    assert (terms == [*OWN, MEASURED, UNEXPLAINED]) == bool(code)


def trial(k: int, folder: Path) -> Counter[str]:
    """Right, missed and wrong names, constants within 1 W, and wrong sums."""
    truth, given = make_supply(SEED, k, folder), folder / "given"
    asked, machine = as_compared(
        given / "log.parquet",
        step="power",
        robot=given / "urdf" / "hexapod.toml",
        alternative="ideal",
        mapping=given / "mapping.toml" if truth["stated"] else None,
    )
    told = account(machine, load_logs(machine, asked).logs, 0, None)
    hidden = set(truth["hidden"])
    if "wrong_sum" in hidden or told.wrong_sum:
        right = told.wrong_sum and "wrong_sum" in hidden
        return Counter({"sums right" if right else "sums wrong": 1})
    names = {n for n in ("constant", "drivers") if n in hidden}
    names |= {f"extra_friction {truth['leg']}"} if "extra_friction" in hidden else set()
    may = (names | ({"returned"} & hidden)).union(*(BESIDE.get(n, set()) for n in hidden))
    found = told.power[told.power["basis"] == "found"].set_index("term")
    classes = [{t, *like.split("+")} for t, like in found["indistinguishable_from"].items()]
    out = Counter({"hidden": len(names), "named": len(found)})
    out["found"] = sum(any(n in one for one in classes) for n in names)
    out["wrong"] = sum(not one & may for one in classes)
    if "constant" in found.index and "constant" in hidden:
        out["constants"] += 1
        out["within 1 W"] += abs(found.loc["constant", "mean_W"] - truth["constant"]) < 1.0
    return out


@pytest.mark.slow
def test_what_is_hidden_is_found_and_nothing_else(tmp_path):
    """The rates of the package's README, less what a few trials more or less may change."""
    total: Counter[str] = Counter()
    for k in range(TRIALS):
        total += trial(k, tmp_path / str(k))
    assert total["found"] >= 0.9 * total["hidden"], total
    assert total["wrong"] <= 0.1 * total["named"], total
    assert total["sums right"] > total["sums wrong"] == 0, total
    assert total["within 1 W"] >= 0.8 * total["constants"], total
