"""What the model lacks, and the noise that is left with everything that was offered."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from pipeline.identification.results import Found, Naming
from pipeline.identification.selection.identify import Identified, estimated_alone, identify
from pipeline.identification.selection.two_positions import READ_OFF, read_off_two
from pipeline.identification.workflow.compared import Compared
from pipeline.identification.workflow.setup import Setup
from pipeline.identification.workflow.written import with_found
from pipeline.progress import Progress


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the model lacks."""

    named: Identified  #: The names and what they rest on.
    compared: Compared  #: Logs with the noise floor that the explanation found.

    @property
    def naming(self) -> Naming:
        """All findings."""
        return self.named.naming

    def estimated(self, found: tuple[Found, ...]) -> tuple[Found, ...]:
        """Findings, those that are kept with the values they have without the others."""
        own = estimated_alone(self.named, [f for f in found if f.kept and f.law != READ_OFF])
        alone = {f.key: f for f in own}
        return tuple(alone.get(f.key, f) for f in found)


def explain(given: Setup, compared: Compared, progress: Progress) -> Explanation:
    """Find what the model lacks.

    Raises:
        GapError: Nothing can be compared.
    """
    named = identify(given.model, compared.measurements, progress)
    found = named.naming.found
    seen = read_off_two(
        reduce(with_found, [f for f in found if f.kept], given.model),
        compared.loaded.prepared,
        compared.parts,
        compared.measurements,
        len(found) + 1,
    )
    names = {f.key for f in seen}
    own = tuple(f for f in found if f.key not in names)
    named = replace(named, naming=replace(named.naming, found=(*own, *seen)))
    noise = named.noise
    logs = tuple(replace(m, noise=np.maximum(m.noise, noise)) for m in compared.measurements)
    return Explanation(named, replace(compared, measurements=logs))
