"""One bandwidth for everything that follows: where the encoder's noise no longer speaks.

Naming compares efforts with inertia times an acceleration that comes from a filtered encoder. Its
noise grows with the 2.5th power of the cut-off, the effort's with the square root; where the first
outweighs the second, columns built from accelerations fit noise (an elasticity that is not there).
The cut-off is lowered until the encoder's noise in the prediction is at most half the effort's, and
below the rate at which the steps of a rounded position come: their error is no noise there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.compare.observe import observe_all
from pipeline.logs.prepared.cycles import with_repeated_noise
from pipeline.logs.prepared.measurement import Measurement
from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.prepared.settings import LONGEST_KERNEL, Settings
from pipeline.logs.quality.sampling import new_values
from pipeline.logs.signals.noise import smoother_noise
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator

Array = NDArray[np.float64]
#: Encoder noise in the prediction over effort noise.
LARGEST_RATIO: Final = 0.5
#: Never below this; a robot's own motion reaches further [Hz].
LEAST_CUTOFF: Final = 8.0


#: Nor above this: a robot's motion does not reach there, resonances of its structure do [Hz].
MOST_CUTOFF: Final = 30.0


def naming_cutoff(model: MachineModel, prepared: Sequence[Prepared]) -> float:
    """The cut-off for naming [Hz], at most that of the prepared logs."""
    now = min(prepared[0].cutoff, *(max(step_rate(one)[1], LEAST_CUTOFF) for one in prepared))
    share = 1.0
    for one, m in zip(prepared, observe_all(model, prepared), strict=True):
        felt = encoder_noise(model, one, m)[:, 0]
        good = (felt > 0) & np.isfinite(m.noise[:, 0])
        if good.any():
            ratio = float(np.median(felt[good] / m.noise[good, 0]))
            share = min(share, float(np.sqrt(LARGEST_RATIO / max(ratio, 1e-12))))
    longest = max(float(one.time[-1] - one.time[0]) for one in prepared)
    least = max(LEAST_CUTOFF, 4.0 / (LONGEST_KERNEL * longest))
    return float(min(now, max(min(share * now, MOST_CUTOFF), least)))


def step_rate(one: Prepared) -> tuple[int, float]:
    """The joint that moves furthest, and how often its position takes a new value [Hz].

    A filter that passes this frequency shows the steps of a rounded position. Joints that hardly
    move may well stand between two steps, and a joint with a velocity column that has the say
    needs none: infinite.
    """
    j = int(np.nanargmax(np.ptp(one.q, axis=0)))
    if (one.fusion.weight[:, j] > 0.5).all():
        return j, np.inf
    good = one.usable[0][:, j]
    return j, new_values(one.log.time[good], one.log.position[good, j])


def with_encoder_noise(
    model: MachineModel, prepared: Sequence[Prepared], measurements: Sequence[Measurement]
) -> tuple[Measurement, ...]:
    """Measurements whose noise floor includes what the encoder's noise does to the prediction."""
    return tuple(
        replace(m, noise=np.hypot(m.noise, encoder_noise(model, one, m)))
        for one, m in zip(prepared, measurements, strict=True)
    )


def encoder_noise(model: MachineModel, one: Prepared, m: Measurement) -> Array:
    """Standard deviation of the prediction from the encoder's noise, shape (J, C).

    Velocity and acceleration noise are taken as independent of one another (an odd and an even
    kernel) and of other joints.
    """
    base = Simulator(m).predict(model)
    total = np.zeros(base.effort.shape[1:])
    for order, jolt in ((1, replace(m, v=m.v + 0.1)), (2, replace(m, a=m.a + 1.0))):
        size = 0.1 if order == 1 else 1.0
        # In motion alone: the step of friction at a reversal is no noise.
        change = np.abs(Simulator(jolt).predict(model).effort - base.effort) / size
        slope = np.median(change, axis=0)
        total += (slope * one.fusion.noise[order - 1][:, None]) ** 2
    total += _force_noise(model, one, m, base) ** 2
    return np.asarray(np.sqrt(total))


def _force_noise(model: MachineModel, one: Prepared, m: Measurement, base: Prediction) -> Array:
    """Standard deviation of the prediction from the noise of measured foot forces, (J, C)."""
    total = np.zeros(base.effort.shape[1:])
    raw = one.log.foot_force
    if m.foot_force is None or raw is None or m.standing is None:
        return total
    # At the log's own rate, where the noise is white.
    flat = np.nan_to_num(raw[one.row]).reshape(len(one), -1)
    lowpass = one.settings.lowpass
    sigma = smoother_noise(
        flat, np.ones(flat.shape, dtype=np.bool_), one.pieces, lowpass, in_band=True
    )
    for axis in range(3):
        known = np.nan_to_num(sigma.reshape(raw.shape[1:])[:, axis])
        push = np.zeros_like(m.foot_force)
        push[..., axis] = m.standing * float(np.median(known))
        pushed = Simulator(replace(m, foot_force=m.foot_force + push)).predict(model)
        total += np.mean((pushed.effort - base.effort) ** 2, axis=0)
    return np.asarray(np.sqrt(total))


def lowered(prepared: Sequence[Prepared], cutoff: float) -> tuple[Prepared, ...]:
    """The same logs at a lower cut-off, masks and noise rebuilt for it from what was read.

    Args:
        prepared: At one cut-off.
        cutoff: At most that one [Hz].
    """
    old = prepared[0].settings
    if cutoff >= old.cutoff * (1 - 1e-9):
        return tuple(prepared)
    reason = (
        f"lowered from {old.cutoff:.3g} Hz ({old.reason}): above it the encoder's noise in the "
        "prediction outweighs the effort's"
    )
    settings = Settings(old.dt, cutoff, reason, old.per_joint)
    return tuple(with_repeated_noise([one.at(settings) for one in prepared]))
