import numpy as np
import pytest

from actuators.errors import ActuatorError
from actuators.shaft import ShaftSeries
from tests.actuators.motions import series


def direction(time, velocity):
    v = np.asarray(velocity, dtype=float)
    return series(time, v, v, v, v).direction[:, 0].tolist()


@pytest.mark.parametrize(
    ("time", "velocity", "expected"),
    [
        ([0, 1, 2], [0, 1, 0], [1, 1, 1]),  # zeros at the ends take the block's direction
        ([0, 1, 2], [0, -1, 0], [-1, -1, -1]),
        ([0, 1, 2, 2, 3], [1, 2, 0, 0, -1], [1, 1, 1, -1, -1]),  # one-sided limits at a break
        ([0, 1, 2], [0, 0, 0], [0, 0, 0]),  # at rest
        ([0, 1, 2], [1e-10, -1e-10, 0], [0, 0, 0]),
        ([0, 1, 1, 2], [1, 0, 0, 0], [1, 1, 0, 0]),  # rest after motion
        ([0, 1, 2], [1, 0, 1], [1, 1, 1]),  # touching
        ([0, 1, 2, 3], [0, 1, 0, -1], [1, 1, 1, -1]),  # unsplit: zero copies the sample before
        ([0], [0], [0]),
        ([0], [-3], [-1]),
    ],
)
def test_sign_of_zero(time, velocity, expected):
    assert direction(time, velocity) == expected


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": [0.0, 2.0, 1.0]}, "never decrease"),
        ({"time": [0.0, np.nan, 1.0]}, "finite"),
        ({"velocity": np.zeros((3, 1))}, "velocity has shape"),
        ({"torque": np.full((3, 2), np.nan)}, "torque of 'a' is not finite in sample 0"),
        ({"joints": ("a", "a")}, "none of them twice"),
        ({"time": []}, "expected"),
    ],
)
def test_bad_series(change, message):
    good = {
        "joints": ("a", "b"),
        "time": [0.0, 1.0, 2.0],
        **dict.fromkeys(("position", "velocity", "acceleration", "torque"), np.zeros((3, 2))),
    }
    with pytest.raises(ActuatorError, match=message):
        ShaftSeries.at_joint(**(good | change))
