"""Three real machines: what is named, and the gap that the model file leaves on rows without a say.

Of torques a plain least-squares ladder leaves 3.15 (tx40) and 0.296 N*m (panda) on the same rows.
"""

from collections.abc import Sequence
from pathlib import Path

import pytest

from pipeline.identification.results import SUSPECTED, Found
from pipeline.identification.workflow.compared import compare_logs, load_logs
from pipeline.identification.workflow.outcome import Outcome, identified
from pipeline.logs.log import TEST
from tests.command_line import as_asked

FILES = Path(__file__).parents[1] / "data_files"
pytestmark = pytest.mark.slow


def run(arguments: Sequence[str]) -> Outcome:
    options, given = as_asked(arguments)
    where = compare_logs(given, given.model, load_logs(given, options))
    return identified(given, where, options)


def found(outcome: Outcome, effect: str) -> list[Found]:
    return [f for f in outcome.held.found if f.effect == effect]


def test_tx40_names_the_coupled_wrist(shared_data):
    folder = shared_data / "tx40"
    log, robot = str(folder / "tx40_log.csv"), str(folder / "tx40.urdf")
    outcome = run([log, "--robot", robot, "--prove-last", "0.4"])
    (wrist,) = [f for f in found(outcome, "transmission_coupling") if "joint_6" in f.place]
    assert wrist.place == ("joint_6", "joint_5")
    assert wrist.values["ratio"] == pytest.approx(1.0, abs=0.1)
    assert wrist.gap_after < 0.4 * wrist.gap_before
    assert wrist.level != SUSPECTED
    assert outcome.gaps[1] <= 3.15


def test_panda_names_its_bodies_and_dry_friction(shared_data):
    folder = shared_data / "panda"
    first, last = (str(folder / f"panda_{n}.csv") for n in ("first60", "last40"))
    outcome = run([first, "--holdout", last, "--robot", str(folder / "panda.urdf")])
    (bodies,) = found(outcome, "rigid_body_parameters")
    assert bodies.level != SUSPECTED
    dry = [f.values["torque"] for f in found(outcome, "coulomb_friction")]
    assert len(dry) >= 3
    assert all(0.1 <= torque <= 0.75 for torque in dry)
    assert outcome.gaps[1] <= 0.33


@pytest.mark.parametrize("friction", [True, False])
def test_xl330_lacks_load_dependent_friction(friction, shared_data):
    """Named first, with and without Coulomb and viscous friction in the model before."""
    names = [str(p) for p in sorted((shared_data / "xl330").glob("*.csv"))]
    learn, held = [n for n in names if "kp200" not in n], [n for n in names if "kp200" in n]
    words = [*learn, "--holdout", *held, "--robot", str(FILES / "xl330.urdf")]
    words += ["--mapping", str(FILES / "xl330.toml"), "--actuators", str(FILES / "xl330_actuators")]
    # At 8 Hz, which the encoder's noise asks for, the free swing hardly has a row off reversals.
    words += ["--alternative", "servo", "--cutoff", "12"]
    words += ["--model", str(FILES / "xl330_coulomb_viscous.toml")] if friction else []
    outcome = run(words)
    first = outcome.held.found[0]
    assert first.effect == "load_dependent_friction"
    assert first.values["share"] == pytest.approx(0.42, abs=0.08)
    assert first.gap_after < 0.9 * first.gap_before
    # Stribeck friction alone gains nothing, as its authors say.
    assert not found(outcome, "stribeck_friction")
    # Logs of the gain that had no say.
    proved = {m.name.split("_")[1] for m in outcome.compared.logs if (m.part == TEST).any()}
    assert proved == {"kp200"}
    before, after = outcome.gaps
    assert after < 0.6 * before or friction
