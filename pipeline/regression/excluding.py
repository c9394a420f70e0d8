"""What is told and what could be in its place: a name stands only where the log excludes others."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.laws.extras import Extra, Kind
from pipeline.regression.laws.friction import BESIDE, QUADRANT
from pipeline.regression.statistics.gram import Columns, Key
from pipeline.regression.statistics.rivals import added
from pipeline.regression.statistics.solve import Fit, compare
from pipeline.regression.statistics.standing import Standing

Array = NDArray[np.float64]
#: As large as this, per what is told, what is not told would make it another law.
OTHER = 0.25
#: Terms that make a law of friction another one.
LAWS = ("coulomb", "viscous", "quadratic", "load", QUADRANT, "saturating@0", "stribeck@2", "offset")
#: Friction per load in two quadrants, of which others are sums.
_BOTH = ("driving", "driven", "motor")
#: What torque at one joint may be in place of another of them.
BESIDES = (Kind.SPRING, Kind.ZERO, Kind.GAIN, Kind.LATE)


def _have_at(have: Collection[tuple[Kind, int]], joint: int) -> set[Kind]:
    """Kinds there are at a joint."""
    return {kind for kind, j in have if j == joint}


class Told:
    """Friction that is told, and how large others at the same joint could be.

    Attributes:
        moved: By how much another would change the size of every column at most, (K,).
    """

    def __init__(
        self, fit: Fit, columns: Columns, weight: Array, keys: Sequence[Key], t: float
    ) -> None:
        self.fit, self.columns, self.weight, self.keys, self.t = fit, columns, weight, keys, t
        self.moved = np.zeros(len(keys))

    def stand(self, joint: int, sizes: Mapping[Key, float], beside: Sequence[Extra]) -> set[Key]:
        """Columns of a joint's law, and its offset and rotor inertia, whose rivals are small."""
        mine = [k for k in self.keys if k[0] == str(joint)]
        law = [k for k in mine if k[1] not in BESIDE]
        parts = [sizes[k] * self.columns.local[joint][k[1]] for k in law]
        size = _rms(np.sum(parts, axis=0)) if parts else 0.0
        terms = {k[1].partition("@")[0] for k in mine}
        gone = {"load", QUADRANT} if terms & set(_BOTH) else set()
        others = [(str(joint), u) for u in LAWS if u.partition("@")[0] not in terms | gone]
        out = set(law) if not law or self._small(size, others) else set()
        at = [self.keys.index(k) for k in law]
        if others and law:
            moves = np.abs(added(self.fit, self.weight, self.keys, others).moves[:, at])
            self.moved[at] = moves.max(axis=0)
        springs = [("shared", n) for e in beside if e.kind is Kind.SPRING for n in e.names]
        for key in mine:
            zero = key[1] == "offset"
            if key[1] in BESIDE and (not zero or self._small(abs(sizes[key]), springs)):
                out.add(key)
        return out

    def _small(self, size: float, others: Sequence[Key]) -> bool:
        if not others:
            return True
        one = added(self.fit, self.weight, self.keys, others)
        most = np.abs(one.size) + self.t * one.error
        return all(
            x * _effect(self.columns, k) < OTHER * size for k, x in zip(others, most, strict=True)
        )


class Excluding(Standing):
    """How large rivals could be."""

    #: Columns whose rivals the log excludes.
    excluded: frozenset[Key] = frozenset()

    def _exclude(self, keys: Sequence[Key], sizes: Mapping[Key, float]) -> Array:
        """Find the columns beside which every rival is known to be small.

        Returns:
            By how much a rival of every column's own joint would change its size at most, (K,).
        """
        offered = self.options.extras & set(BESIDES)
        have = {e.same for e in self.extras}
        joints = range(self.model.nv)
        felt, actions = self._acting(
            [(Extra(k, j), 1) for k in BESIDES for j in joints if k in offered - _have_at(have, j)]
        )
        columns = self._columns(self.couplings)
        columns = replace(columns, shared={**columns.shared, **actions})
        fit = self._fit(self._system(columns), columns, self.sigma)
        beside = [e for e, _ in felt]
        told = Told(fit, columns, self.weight, keys, self._quantile(self.options.coverage))
        out = {k for k in keys if k[0] == "shared" and k[1] not in self.actions}
        for j in joints:
            out |= told.stand(j, sizes, [e for e in beside if e.joint == j])
        loss = fit.losses(self.folds, self.weight, fit.columns(keys))
        for e in self.extras:
            own = self._of(e)
            rest = [k for k in keys if k not in own]
            acts = {j for n in e.names for j in self.actions[n]}
            instead = [
                k for x in beside if x.joint in acts and x.kind is not e.kind for k in self._of(x)
            ]
            if not any(self._as_good(fit, loss, [*rest, k]) for k in instead):
                out.update(own)
        self.excluded = frozenset(out)
        return told.moved

    def _as_good(self, fit: Fit, have: Array, keys: Sequence[Key]) -> bool:
        """Whether other columns predict as well, within one standard error."""
        worse, error = compare(
            fit.losses(self.folds, self.weight, fit.columns(keys)), have, self.weight
        )
        return worse <= error


def _effect(columns: Columns, key: Key) -> float:
    """Torque of a column of size one, root mean square over the joints it acts on."""
    place, term = key
    if place != "shared":
        return _rms(columns.local[int(place)][term])
    return float(np.sqrt(sum(_rms(x) ** 2 for x in columns.shared[term].values())))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
