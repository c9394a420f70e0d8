"""Which explanation: a few effects in an otherwise true model, or a machine fitted as a whole.

A robot file vouches for its bodies: where at most a few effects bring the gap down to noise, they
are the answer. Where more would be needed, or more than noise is left, and of a bare URDF, which
does not say how well its bodies are known, everything is fitted together: bodies, friction of every
joint, couplings, springs, ripple and what sensors get wrong. The whole machine is kept where it
takes a large part of what the few effects leave.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.identification import results as limits
from pipeline.identification.results import Found, Naming
from pipeline.identification.selection.identify import Identified, estimated_alone, identify
from pipeline.identification.whole.errors import NotWholeError
from pipeline.identification.whole.fit import Whole, fit_whole
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.prepared.measurement import CHOOSE, FIT
from pipeline.progress import Progress


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the model lacks.

    Attributes:
        naming: All findings in the order in which they are applied.
        named: What competed by itself.
        where: Logs with the noise floor that the explanation found.
        whole: What was fitted together before; None where a few effects are enough.
    """

    naming: Naming
    named: Identified
    where: Whereabouts
    whole: Whole | None = None

    def estimated(self, found: tuple[Found, ...]) -> tuple[Found, ...]:
        """Findings with the values they have without those that are left out."""
        count = len(self.whole.found) if self.whole else 0
        keys = {f.key for f in found[count:] if f.kept}
        own = estimated_alone(self.named, [f for f in found[count:] if f.key in keys])
        alone = {f.key: f for f in own}
        return (*found[:count], *(alone.get(f.key, f) for f in found[count:]))


def explain(given: Setup, where: Whereabouts, progress: Progress) -> Explanation:
    """Find what the model lacks.

    Raises:
        GapError: Nothing can be compared.
    """
    if given.robot is not None and given.robot.floating:
        return _alone(identify(given.model, where.measurements), where)
    if given.file.edits:
        return _alone(identify(given.model, where.measurements), where)
    few = None
    if given.robot is not None:
        progress.step("letting a few effects compete")
        few = identify(given.model, where.measurements, most=limits.FEW)
        if few.enough and not (few.excess > limits.UNEXPLAINED).any():
            return _alone(few, where)
    progress.step("fitting the whole machine")
    try:
        whole = fit_whole(given.model, where)
    except NotWholeError as error:
        progress.step("letting effects compete")
        note = f"the machine was not fitted as a whole: {error}"
        return _alone(identify(given.model, where.measurements), where, note)
    where = _with_floor(where, whole)
    progress.step("letting effects compete")
    rest = identify(whole.model, where.measurements, without=whole.decided)
    if few is not None and few.enough and not _takes_a_large_part(few, rest):
        return _alone(few, where)
    found = [
        replace(f, order=number)
        for number, f in enumerate((*whole.found, *rest.naming.found), start=1)
    ]
    notes = (*rest.naming.notes, *whole.notes)
    naming = replace(rest.naming, found=tuple(found), notes=notes, base=whole.result.base)
    return Explanation(naming, rest, where, whole)


def _alone(named: Identified, where: Whereabouts, *notes: str) -> Explanation:
    return Explanation(replace(named.naming, notes=(*named.naming.notes, *notes)), named, where)


def _with_floor(where: Whereabouts, whole: Whole) -> Whereabouts:
    """Logs whose floor is at least the noise that the richest model leaves.

    In another motion than that which was learnt from, what that left open of the bodies counts too.
    """
    if where.measurements[0].channels[0] != "torque":
        return where
    least = np.nan_to_num(whole.floor)
    measurements = []
    for m in where.measurements:
        noise = m.noise.copy()
        noise[:, 0] = np.maximum(noise[:, 0], least)
        if not np.isin(m.part, (FIT, CHOOSE)).any():
            noise[:, 0] = np.hypot(noise[:, 0], np.nan_to_num(whole.doubt(m)))
        measurements.append(replace(m, noise=noise))
    return replace(where, measurements=tuple(measurements))


def _takes_a_large_part(few: Identified, whole: Identified) -> bool:
    """Whether the whole machine takes a large part of what a few effects leave beyond noise."""
    before, after = (float(np.sum(np.maximum(x.excess**2 - 1.0, 0.0))) for x in (few, whole))
    return after < (1.0 - limits.NEAREST_SHARE) * before
