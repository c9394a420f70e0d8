"""Ways in which columns of a log are commonly not what their names say.

A `Reading` says which column, times what, shifted by what, is a joint's effort and position. What
identification names itself is left to it: factors, delays and zeros near none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from actuators.arrays import Array, Index

#: Factors on an effort: nearer to one they are a gain or bodies that differ.
LEAST, MOST = 2.5, 3000.0
FACTORS: Final = tuple(s for f in np.geomspace(3.0, MOST, 10) for s in (f, 1.0 / f))
#: Factors on a position that is read at a motor, or in degrees.
RATIOS: Final = tuple(np.geomspace(3.0, 300.0, 11))
#: Delays of an effort [s]: shorter ones are a delay of the machine's own.
DELAYS: Final = (-0.2, -0.12, -0.07, -0.04, 0.04, 0.07, 0.12, 0.2)
#: Zeros of a position [rad].
ZEROS: Final = tuple(k * np.pi / 6 for k in range(-5, 7) if k)


@dataclass(frozen=True, eq=False)
class Reading:
    """What each joint's effort and position are read from."""

    effort_of: Index  #: Column of the effort, shape (J,).
    effort_factor: Array  #: On it, shape (J,).
    late: Array  #: By which it comes late, shape (J,) [s].
    position_of: Index  #: Column of the position, shape (J,).
    position_factor: Array  #: On it, shape (J,).
    zero: Array  #: Added to it, shape (J,) [rad].

    def at(self, which: Sequence[int], **values: object) -> Reading:
        """The same with other values at some joints."""
        changes = {}
        for name, value in values.items():
            changes[name] = getattr(self, name).copy()
            changes[name][list(which)] = value
        return replace(self, **changes)

    @property
    def motion(self) -> bytes:
        """Equal for readings with equal positions."""
        return b"".join(x.tobytes() for x in (self.position_of, self.position_factor, self.zero))


def as_named(joints: int) -> Reading:
    """Every column is what its name says."""
    own, one, none = np.arange(joints), np.ones(joints), np.zeros(joints)
    return Reading(own, one, none, own, one, none)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One way in which columns may be wrong."""

    cause: str  #: Key of `CAUSES`.
    joints: tuple[int, ...]  #: Whose columns.
    reading: Reading  #: That mends it.
    size: float = 1.0  #: Factor, delay or zero; one where there is none to choose.

    def resized(self, size: float, start: Reading) -> Hypothesis:
        """The same with another size, from the reading that is mended."""
        return _sized(self.cause, self.joints, size, start)


#: The simplest first: where several explain a log as well, the first of them is taken.
CAUSES: Final = (
    *("sign", "exchanged", "scale", "late"),
    *("both_exchanged", "position_sign", "position_scale", "position_zero"),
)


_SIZES: Final = {"sign": (1.0,), "scale": FACTORS, "late": DELAYS}
_POSITION_SIZES: Final = {"position_sign": (1.0,), "position_scale": RATIOS, "position_zero": ZEROS}


def _sized(cause: str, joints: tuple[int, ...], size: float, r: Reading) -> Hypothesis:
    which, other = list(joints), list(joints[::-1])
    effort, position = r.effort_factor[which], r.position_factor[which]
    changes: dict[str, dict[str, Array | Index]] = {
        "sign": {"effort_factor": -effort},
        "scale": {"effort_factor": effort / size},
        "late": {"late": r.late[which] + size},
        "exchanged": {"effort_of": r.effort_of[other]},
        "both_exchanged": {"effort_of": r.effort_of[other], "position_of": r.position_of[other]},
        "position_sign": {"position_factor": -position},
        "position_scale": {"position_factor": position / size},
        "position_zero": {"zero": r.zero[which] - size},
    }
    return Hypothesis(cause, joints, r.at(which, **changes[cause]), size)


def of_efforts(r: Reading, live: Sequence[int], odd: Sequence[int]) -> Iterator[Hypothesis]:
    """About efforts alone, of joints that are compared; pairs with one that is explained badly."""
    # Bodies that give way to a wrong column leave the misfit at another joint: each is tried.
    return _tries(r, live, live, odd, _SIZES, "exchanged")


def of_positions(r: Reading, live: Sequence[int], odd: Sequence[int]) -> Iterator[Hypothesis]:
    """About positions, too; of single ones where efforts are explained badly."""
    return _tries(r, live, odd, odd, _POSITION_SIZES, "both_exchanged")


def _tries(
    r: Reading,
    live: Sequence[int],
    alone: Sequence[int],
    odd: Sequence[int],
    sizes: Mapping[str, Sequence[float]],
    exchanged: str,
) -> Iterator[Hypothesis]:
    for cause, values in sizes.items():
        if len(live) > 1 and cause != "position_zero":
            yield from (_sized(cause, tuple(live), float(size), r) for size in values)
    for cause, values in sizes.items():
        for j in alone:
            yield from (_sized(cause, (j,), float(size), r) for size in values)
    for pair in combinations(live, 2):
        if set(pair) & set(odd):
            yield _sized(exchanged, pair, 1.0, r)
