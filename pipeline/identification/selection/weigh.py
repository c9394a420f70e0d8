"""What a model leaves of the gap once the tolerances of the machine's parts are estimated.

A model says what the files and its effects say; every machine differs from it within the stated
tolerances (masses, torque constants, encoder zeros). They are estimated on *fit* and *choose*, no
further than four of their standard deviations, and the model is simulated with them. What counts
is what is then left on *prove*, which had no say in anything.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.regression.design_matrix import make_benches
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit, tolerances_of
from pipeline.identification.regression.tolerances import with_tolerances
from pipeline.identification.selection.residual import errors
from pipeline.logs.prepared.measurement import CHOOSE, FIT, Measurement
from pipeline.machine.machine import MachineModel

Array = NDArray[np.float64]
#: Noise levels that differ by less are the same.
_RESCALED = 1.15
_ROUNDS = 3


class Weighing:
    """Estimates the tolerances of one model after another along the same logs."""

    def __init__(self, model: MachineModel, measurements: Sequence[Measurement]) -> None:
        """Begin.

        Args:
            model: Any of those to be weighed; what the others share with it is computed once.
            measurements: Logs with parts, from `observe`.

        Raises:
            NamingError: A part of the data has no usable row.
        """
        self._problem = Problem(model, make_benches(measurements), floor_of(measurements))

    def calibrated(self, model: MachineModel) -> MachineModel:
        """A model with the tolerances of the machine's parts at their estimates.

        Where the model leaves more than noise, tolerances are held against what it leaves: they
        explain what is theirs, not what is missing.
        """
        problem = refit(self._problem.with_model(model))
        for _ in range(_ROUNDS):
            squares, _ = errors(problem, (FIT, CHOOSE))
            sigma = np.maximum(problem.floor, np.sqrt(squares))
            ratio = sigma / problem.sigma
            if ((ratio < _RESCALED) & (ratio > 1.0 / _RESCALED)).all():
                break
            problem = refit(problem.rescaled(sigma))
        self._problem = problem
        if (problem.sigma != problem.floor).any():
            self._problem = problem.rescaled(problem.floor)
        return with_tolerances(model, tolerances_of(problem))


def floor_of(measurements: Sequence[Measurement], *parts: int) -> Array:
    """Standard deviation of the noise, shape (J, C), of the logs with rows in some parts.

    Args:
        measurements: One per log.
        parts: *fit* and *choose* by default: logs that only prove have no say, in this neither.
    """
    own = [m for m in measurements if np.isin(m.part, parts or (FIT, CHOOSE)).any()]
    return np.asarray(np.sqrt(np.mean([m.noise**2 for m in own or measurements], axis=0)))
