"""The aims on two real machines: what is named, and how much smaller the gap is on other data."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.signal
from numpy.typing import NDArray

from pipeline.commands.main import main
from pipeline.effects.model_file import apply_edits, model_text, read_model_file
from pipeline.identification.compare.circumstances import overall
from pipeline.identification.results import SUSPECTED, Found
from pipeline.identification.workflow.compared import Compared, compare_logs, load_logs
from pipeline.identification.workflow.outcome import check, identified
from pipeline.identification.workflow.written import Validated, edits_of
from pipeline.logs.log import TEST, Log
from pipeline.simulation.machine import Machine
from pipeline.simulation.predict import Simulator
from tests.compared import as_asked, base_model

Array = NDArray[np.float64]
FILES = Path(__file__).parents[1] / "data_files"
COULOMB_VISCOUS = FILES / "xl330_coulomb_viscous.toml"


@dataclass(frozen=True, eq=False)
class Run:
    """What was found and written, and the gap that the file leaves, stage by stage."""

    given: Machine
    where: Compared
    validated: Validated

    def found(self, effect: str) -> list[Found]:
        return [f for f in self.validated.found if f.effect == effect]


def run(arguments: Sequence[str]) -> Run:
    options, given = as_asked(arguments)
    where = compare_logs(given, given.model, load_logs(given, options))
    return Run(given, where, identified(given, where, options).validated)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def written(machine: Run, folder: Path) -> Path:
    """The model file of a run."""
    path = folder / "model.toml"
    text = machine.validated.text
    # Its robot stands relative to the folder of a run.
    given = machine.given.path.resolve().as_posix()
    path.write_text(re.sub(r'^file = ".*"$', f'file = "{given}"', text, flags=re.M), "utf-8")
    return path


def score(model: Path, log: Path, cutoff: float, rate: float, *, last: float = 1.0) -> Array:
    """What a model file leaves of a log, as one scores a plain least-squares fit, (N, J) [N*m].

    One Butterworth of order 4 forward and backward on everything, the velocity column where there
    is one, every row of the last share, no tolerance.
    """
    file, table = read_model_file(model), pd.read_csv(log)
    machine = apply_edits(base_model(file), file.edits)
    time = table["time_s"].to_numpy()
    dt = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], dt)
    sos = scipy.signal.butter(4, 2.0 * cutoff * dt, output="sos")

    def smooth(x: Array) -> Array:
        return np.asarray(scipy.signal.sosfiltfilt(sos, x, axis=0))

    def column(kind: str) -> Array:
        names = [f"{joint}__{kind}" for joint in machine.joints]
        return smooth(np.column_stack([np.interp(grid, time, table[n]) for n in names]))

    q, torque = column("position_rad"), column("torque_Nm")
    logged = f"{machine.joints[0]}__velocity_rad_s" in table
    v = column("velocity_rad_s") if logged else np.gradient(q, dt, axis=0)
    n, joints = q.shape
    m = Log(
        name=log.stem,
        time=grid,
        joints=machine.joints,
        q=q,
        v=v,
        a=np.gradient(v, dt, axis=0),
        channels=("torque",),
        effort=torque[..., None],
        noise=np.ones((joints, 1)),
        mask=np.ones((n, joints), dtype=np.bool_),
        part=np.zeros(n, dtype=np.int8),
        block=np.zeros(n, dtype=np.intp),
        pieces=(slice(0, n),),
        rest_speed=np.full(joints, 1e-3),
    )
    left = torque - smooth(Simulator(m).predict(machine).effort[..., 0])
    edge = 0 if last < 1.0 else round(0.5 / dt)
    rows = slice(edge or round((1.0 - last) * n), n - edge, max(1, round(1.0 / (dt * rate))))
    return np.asarray(left[rows])


@pytest.fixture(scope="module")
def tx40(shared_data: Path) -> Run:
    folder = shared_data / "tx40"
    log, robot = str(folder / "tx40_log.csv"), str(folder / "tx40.urdf")
    return run([log, "--robot", robot, "--prove-last", "0.4"])


@pytest.mark.slow
def test_tx40_names_the_coupled_wrist_and_is_better_than_a_plain_ladder_on_the_last_part(
    tx40: Run, shared_data: Path, tmp_path: Path
) -> None:
    """Every row, also those at rest, by the model file alone; a plain ladder reaches 3.15 N*m.

    The aim, 2.05, is not reached: 1.9 to 3.0 with small changes of the search, which has many
    points here that no single step improves.
    """
    (wrist,) = [f for f in tx40.found("transmission_coupling") if "joint_6" in f.place]
    assert wrist.place == ("joint_6", "joint_5")
    assert wrist.values["ratio"] == pytest.approx(1.0, abs=0.1)
    assert wrist.gap_after < 0.4 * wrist.gap_before
    assert wrist.level != SUSPECTED
    log = shared_data / "tx40" / "tx40_log.csv"
    left = score(written(tx40, tmp_path), log, 100.0, 500.0, last=0.4)
    assert rms(left) <= 3.15


@pytest.fixture(scope="module")
def panda(shared_data: Path) -> Run:
    folder = shared_data / "panda"
    first, last = (str(folder / f"panda_{n}.csv") for n in ("first60", "last40"))
    return run([first, "--holdout", last, "--robot", str(folder / "panda.urdf")])


@pytest.mark.slow
def test_panda_names_its_bodies_and_dry_friction_and_is_about_as_good_as_a_plain_ladder(
    panda: Run, shared_data: Path, tmp_path: Path
) -> None:
    """A plain ladder reaches 0.296 N*m on the last part; the aim, 0.28, is not: 0.29 to 0.32."""
    (bodies,) = panda.found("rigid_body_parameters")
    assert bodies.level != SUSPECTED
    dry = [f.values["torque"] for f in panda.found("coulomb_friction")]
    assert len(dry) >= 3
    assert all(0.1 <= torque <= 0.75 for torque in dry)
    log = shared_data / "panda" / "panda_last40.csv"
    assert rms(score(written(panda, tmp_path), log, 20.0, 100.0)) <= 0.33


@pytest.mark.slow
def test_shrink_gives_what_was_promised(tx40: Run, shared_data: Path, tmp_path: Path) -> None:
    log, model = str(shared_data / "tx40" / "tx40_log.csv"), str(written(tx40, tmp_path))
    options, given = as_asked(["shrink", log, "--prove-last", "0.4", "--model", model])
    where = compare_logs(given, given.model, load_logs(given, options))
    last = check(given, where).validated.stages[-1]
    assert overall(last.gap) == pytest.approx(overall(tx40.validated.stages[-1].gap), rel=0.01)


def xl330_arguments(folder: Path) -> list[str]:
    names = [str(p) for p in sorted((folder / "xl330").glob("*.csv"))]
    learn, held = [n for n in names if "kp200" not in n], [n for n in names if "kp200" in n]
    files = ("--robot", "xl330.urdf", "--mapping", "xl330.toml", "--actuators", "xl330_actuators")
    where = [f if f.startswith("--") else str(FILES / f) for f in files]
    # At 8 Hz, which the encoder's noise asks for, the free swing hardly has a row off reversals.
    more = ("--alternative", "servo", "--cutoff", "12")
    return [*learn, "--holdout", *held, *where, *more]


@pytest.fixture(scope="module")
def xl330(shared_data: Path) -> Run:
    return run([*xl330_arguments(shared_data), "--model", str(COULOMB_VISCOUS)])


@pytest.mark.slow
@pytest.mark.parametrize("friction", [True, False])
def test_xl330_lacks_load_dependent_friction(friction: bool, xl330: Run, shared_data: Path) -> None:
    """Named first, with and without Coulomb and viscous friction in the model before."""
    one = xl330 if friction else run(xl330_arguments(shared_data))
    first = one.validated.found[0]
    assert first.effect == "load_dependent_friction"
    assert first.values["share"] == pytest.approx(0.42, abs=0.08)
    assert first.gap_after < 0.9 * first.gap_before
    # Stribeck friction alone gains nothing, as its authors say.
    assert not one.found("stribeck_friction")
    assert not one.found("backdrive_loss")


@pytest.mark.slow
def test_xl330_voltage_of_a_gain_that_had_no_say(xl330: Run) -> None:
    proved = {m.name.split("_")[1] for m in xl330.where.logs if (m.part == TEST).any()}
    assert proved == {"kp200"}
    before = xl330.validated.found[0].gap_before
    assert before > 0.4
    assert xl330.validated.stages[-1].gap[0] < 0.6 * before


@pytest.mark.slow
def test_xl330_moves_as_the_machine_does_under_its_servos_law(
    xl330: Run, shared_data: Path, tmp_path: Path
) -> None:
    """Mean position error on gain 200; the authors' ladder gives 62, 44 and 31 mrad.

    The aim, 28 mrad, is not reached.
    """
    edits = edits_of(xl330.validated.found, "logs of gains 100 and 800")
    found = tmp_path / "found.toml"
    found.write_text(
        model_text(xl330.given.stated_file.with_edits(edits), tmp_path), encoding="utf-8"
    )
    out = tmp_path / "out"
    arguments = ["--model", str(found), "--out", str(out)]
    assert main(["gap", "forward", *xl330_arguments(shared_data), *arguments]) == 0
    with (out / "forward.csv").open(encoding="utf-8", newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["log"] == "all"]
    errors = {row["model"]: float(row["position_mean_abs_rad"]) for row in rows}
    coulomb_viscous = errors["viscous_friction at pendulum_joint"]
    load = errors["load_dependent_friction at pendulum_joint"]
    *_, last = errors.values()
    assert load < 0.75 * coulomb_viscous
    assert load < 0.055
    assert last < 0.062
