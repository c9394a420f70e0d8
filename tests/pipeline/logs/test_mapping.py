"""The mapping file: what it does to foreign columns, and the one line a bad one gives."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.logs.checks import judge
from pipeline.logs.log import Recording
from pipeline.logs.read import read_log
from tests.pipeline.logs.test_read import one_line

Array = NDArray[np.float64]
Read = Callable[..., Recording]


def test_rename_scale_flip_zero_and_unit(columns, read):
    foreign = {"t": 1e3 * columns["time_s"]}
    foreign["enc_shoulder"] = 90.0 - np.degrees(columns["a__position_rad"])
    foreign["enc_elbow"] = 90.0 - np.degrees(columns["b__position_rad"])
    foreign["mA_shoulder"] = 1e3 * columns["a__torque_Nm"]
    foreign["mA_elbow"] = 2e3 * columns["b__torque_Nm"]
    rules = """
        [time]
        column = "t"
        unit = "ms"
        [columns."enc_*"]
        as = "*__position_rad"
        unit = "deg"
        zero = 90
        flip = true
        [columns."mA_*"]
        as = "*__current_A"
        unit = "mA"
        [columns.mA_elbow]
        as = "elbow__current_A"
        unit = "mA"
        scale = 0.5
        [joints]
        shoulder = "a"
        elbow = "b"
        """
    log = read(foreign, rules)
    assert log.time == pytest.approx(columns["time_s"])
    assert log.position[:, 0] == pytest.approx(columns["a__position_rad"], abs=1e-12)
    assert log.effort == "current"
    assert log.of(log.effort)[:, 0] == pytest.approx(columns["a__torque_Nm"])
    assert log.of(log.effort)[:, 1] == pytest.approx(columns["b__torque_Nm"])


def test_constants_and_rows_with_the_drive_off(columns, read):
    columns["on"] = np.where(columns["time_s"] < 2.0, 1.0, 0.0)
    rules = """
        [controller]
        gain_per_rad = 2
        [constants]
        supply__voltage_V = {value = 7.4, unit = "V"}
        [torque_enabled]
        a = "on"
        """
    log = read(columns, rules)
    assert log.torque_off[-1].tolist() == [True, False]
    assert log.of("supply") == pytest.approx(7.4)
    assert log.gain == 2.0


@pytest.mark.parametrize("separator", [";", " "])
def test_separators_and_decimal_commas_are_told_by_the_file(
    separator, two_joints, columns, tmp_path
):
    lines = [separator.join(columns)]
    for row in zip(*columns.values(), strict=True):
        lines.append(separator.join(repr(float(x)).replace(".", ",") for x in row))
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    log = read_log(path, two_joints)
    assert np.array_equal(log.position[:, 0], columns["a__position_rad"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("efort = 'torque'", ("efort", "did you mean 'effort'")),
        ("effort = 'tork'", ("tork",)),
        ("[columns.x]\nunit = 'degrees'", ("degrees", "unknown unit")),
        ("[columns.x]\nscale = 0", ("scale", "zero")),
        ("[time]\nsample_rate = -5", ("sample_rate", "greater than 0")),
        ("[controller]\ntorque_off_bridge = 'opn'", ("did you mean 'open'",)),
        ("[constants.a__temperature_degC]\nvalue = 3\nunit = 'N'", ("a unit of force",)),
        ("[columns.nothing]\nas = 'a__power_W'", ("nothing", "log.csv")),
        ("[columns.a__torque_Nm]\nas = 'a__torq_Nm'", ("did you mean 'a__torque_Nm'",)),
        ("[columns.a__torque_Nm]\nunit = 'A'", ("current", "torque")),
        ("[columns.a__torque_Nm]\nas = 'b__torque_Nm'", ("same channel",)),
        ("[torque_enabled]\nc = 'a__torque_Nm'", ("'c'", "no joint of two")),
        ("effort = 'voltage'", ("voltage",)),
        ("[time]\ncolumn = 'tme_s'", ("time: log.csv has no column 'tme_s'", "time_s")),
        ("[joints]\nshoulder = 'a'", ("no column of log.csv is of 'shoulder'",)),
        ("[constants.a__temperatur_degC]\nvalue = 3\nunit = 'degC'", ("did you mean 'a__temp",)),
    ],
)
def test_a_bad_mapping_gives_one_clear_line(text, words, columns, read):
    one_line(lambda: read(columns, text), words)


Columns = dict[str, Array]
#: Stiffness [N*m/rad] and damping [N*m*s/rad] of a and b.
KP, KD = np.array([40.0, 60.0]), np.array([0.5, 0.8])
GAINS = "[pd_gains]\nkp = {a = 40.0, b = 60.0}\nkd = {a = 0.5, b = 0.8}\n"


@pytest.fixture
def targets(columns: Columns) -> Columns:
    """The log without its torque, with targets that ask for just this torque."""
    out = {k: v for k, v in columns.items() if "torque" not in k}
    for j, joint in enumerate("ab"):
        q, v = columns[f"{joint}__position_rad"], columns[f"{joint}__velocity_rad_s"]
        out[f"{joint}__goal_position_rad"] = (
            q + (columns[f"{joint}__torque_Nm"] + KD[j] * v) / KP[j]
        )
    return out


def test_the_law_gives_back_the_torque_that_was_asked_for(targets, columns, read, two_joints):
    log = read(targets, GAINS)
    torque = log.of(log.effort)
    for j, joint in enumerate("ab"):
        assert np.allclose(torque[:, j], columns[f"{joint}__torque_Nm"], atol=1e-9)
    assert "kp (goal - position)" in log.derived["torque"]
    found = [f for f in judge(log, two_joints)[0] if f.verdict == "warning"]
    assert any("not measured" in f.detail for f in found)


def test_a_law_that_lacks_gains_is_refused_in_one_line(targets, read):
    for text, words in (
        ("", "[pd_gains]"),
        ("[pd_gains]\nkp = {a = 1.0}", "'b'"),
        ("[pd_gains]\nkp = {a = 1.0, b = 1.0, c = 1.0}", "'c'"),
    ):
        one_line(lambda text=text: read(targets, text), (words,))  # type: ignore[misc]
