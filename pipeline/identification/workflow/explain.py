"""Which explanation: a few effects in an otherwise true model, or a machine fitted as a whole.

The simplest one first. Where at most a few effects bring the gap down to noise, they are the
answer; of a bare URDF, which does not say how well its bodies are known, only where these and
friction do not explain the log with fewer claims. Where more would be needed, or more than noise is
left, bodies, friction of every joint and couplings are fitted together, and the other effects of
the catalogue are looked for in what that leaves. The whole machine is kept where it takes a large
part of what the few effects leave.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.identification import results as limits
from pipeline.identification.results import Found, Naming
from pipeline.identification.selection.identify import Identified, estimated_alone, identify
from pipeline.identification.whole.errors import NotWholeError
from pipeline.identification.whole.fit import FAMILIES, OF_BODIES, Whole, fit_whole
from pipeline.identification.workflow.locate import Progress, Whereabouts
from pipeline.identification.workflow.setup import Setup


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the model lacks.

    Attributes:
        naming: All findings in the order in which they are applied.
        named: What competed by itself.
        whole: What was fitted together before; None where a few effects are enough.
    """

    naming: Naming
    named: Identified
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
        return _alone(identify(given.model, where.measurements))
    if given.file.edits:
        return _alone(identify(given.model, where.measurements))
    progress.step("letting a few effects compete")
    few = identify(given.model, where.measurements, most=limits.FEW)
    explained = few.enough and not (few.excess > limits.UNEXPLAINED).any()
    if explained and (given.robot is not None or not _claims(few)):
        return _alone(few)
    progress.step("fitting the whole machine")
    try:
        whole = fit_whole(given.model, where)
    except NotWholeError as error:
        progress.step("letting effects compete")
        note = f"the machine was not fitted as a whole: {error}"
        return _alone(identify(given.model, where.measurements), note)
    if not whole.found:
        return _alone(few if few.enough else identify(given.model, where.measurements))
    progress.step("letting effects compete")
    rest = identify(whole.model, where.measurements, without=whole.decided)
    if explained:
        # A URDF alone vouches for no mass: what its bodies and friction explain as well, with fewer
        # claims about sensors and springs, is theirs.
        if (rest.excess > limits.UNEXPLAINED).any() or _claims(rest) >= _claims(few):
            return _alone(few)
    elif few.enough and not _takes_a_large_part(few, rest):
        return _alone(few)
    found = [
        replace(f, order=number)
        for number, f in enumerate((*whole.found, *rest.naming.found), start=1)
    ]
    notes = (*rest.naming.notes, *whole.notes)
    naming = replace(rest.naming, found=tuple(found), notes=notes, base=whole.result.base)
    return Explanation(naming, rest, whole)


def _alone(named: Identified, *notes: str) -> Explanation:
    return Explanation(replace(named.naming, notes=(*named.naming.notes, *notes)), named)


def _claims(named: Identified) -> int:
    """Findings that are neither friction nor bodies, which no URDF states as they are."""
    return sum(f.kept and f.effect not in FAMILIES | OF_BODIES for f in named.naming.found)


def _takes_a_large_part(few: Identified, whole: Identified) -> bool:
    """Whether the whole machine takes a large part of what a few effects leave beyond noise."""
    before, after = (float(np.sum(np.maximum(x.excess**2 - 1.0, 0.0))) for x in (few, whole))
    return after < (1.0 - limits.NEAREST_SHARE) * before
