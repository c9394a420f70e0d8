"""Error rates and sizes of the search."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.regression.laws.extras import Kind


@dataclass(frozen=True)
class Options:
    """Error rates and sizes of the search.

    Attributes:
        error_rate: Chance of one wrong coupling, of a refit of true bodies, and of one confirmed
            size whose interval should have held zero, per log.
        coverage: Of the intervals.
        sure: Share of draws from which a name is confirmed: so often it should be right.
        draws: Of the log's blocks.
        uncertainties: Of the URDF that validation chooses from, beside no refit.
        closes: Share of what stays unexplained below which a size closes next to nothing.
        needed: Share of the noise's power from which a size is needed, though its name may be
            another's.
        stands: Of the same, from which what is beside bodies and friction can be confirmed.
        worth: Of the same, below which there is no claim of what is beside bodies, friction and
            couplings.
        bends: Of the general member: how far it may depart from Coulomb, viscous and
            load-dependent friction, as a share of the joint's torque; validation chooses.
        fewest: Blocks below which nothing is confirmed: too few to know their own scatter.
        seed: Of the draws.
        extras: Looked for beside bodies, friction and couplings.
    """

    error_rate: float = 0.05
    coverage: float = 0.95
    sure: float = 0.95
    draws: int = 20
    uncertainties: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
    closes: float = 0.01
    needed: float = 1.0
    stands: float = 0.5
    worth: float = 0.1
    bends: tuple[float, ...] = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
    fewest: int = 12
    seed: int = 0
    extras: frozenset[Kind] = frozenset()
