"""Which names explain a log best: steps from set to set on sums, then columns about the answer.

Blocks stay throughout. From bodies that are the files' and from bodies that may be anything, names
are added, removed and exchanged one by one, and links let loose, as long as the evidence rises;
then columns are made anew about the estimates, with nonlinear parameters moved, and the search goes
on. The likelier of the two answers stands.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import Effect
from pipeline.effects.motor_sensors import TorqueRipple
from pipeline.identification.design import (
    DataSet,
    Design,
    Key,
    Placed,
    Term,
    left_at,
    make_design,
    parts_of,
    placed_in,
)
from pipeline.identification.fit import NOTHING, Fit, refreshed, settled, start_fit
from pipeline.identification.offered import (
    COMMON,
    block_terms,
    name_terms,
    payload_terms,
    reversals,
    ripple_terms,
)
from pipeline.identification.settings import BARE, BENT, FORESEES, NO_RISE, STEP, STRAIGHT
from pipeline.identification.tolerances import BodyStrain, Slope, inertial, slope
from pipeline.machine.machine import MachineModel

logger = logging.getLogger("legwatt")

#: Moves that are estimated in earnest at each step, the most promising ones.
_TRIED: Final = 3
#: Turns of scales and noise in a trial.
_QUICK: Final = 5
#: Times the search goes on about its own answer, at most.
_ROUNDS: Final = 3
#: Times that a name by itself is followed to where its columns no longer change.
_NEWTON: Final = 5
#: Shares of the way to linear estimates at which columns may be made anew.
_SHARES: Final = (1.0, 0.5, 0.25, 0.1, 0.0)
#: Steps of an estimate with bodies that bend, at most, and the damping that leaves no step.
_DAMPED: Final = 30
_STIFF: Final = 1e6
#: Factors of a nonlinear parameter that compete with its value.
_VARIED: Final = (0.6, 0.8, 1.25, 1.6)
#: Scale at which the gain of a loose body is foreseen.
_FORESEEN: Final = (0.02, 0.1)

Move = tuple[float, tuple[int, ...], frozenset[str]]


def searched(model: MachineModel, data_sets: Sequence[DataSet], floor: Array) -> Fit:
    """The likeliest set of names.

    Args:
        model: What the engineer has.
        data_sets: Of its logs.
        floor: Sensors' noise, shape (J, C).
    """
    known = (model, data_sets[0].simulator.measured, reversals(model, data_sets))
    design = make_design(model, data_sets, [*block_terms(*known), *name_terms(*known)])
    noise = np.array([e.level(floor) for e in design.equations])
    first = settled(start_fit(design, noise))
    design = design.extended([*ripple_terms(first), *payload_terms(first)])
    first = settled(start_fit(design, noise))
    start = near(first)
    every = frozenset(t.block for t in design.terms if isinstance(t.effect, BodyStrain))
    loose = [_tied(near(settled(replace(start, loose=every))))] if every else []
    alone = _alone(first)
    starts = [start, *loose, *([alone] if alone else [])]
    return polished(likeliest([climbed(fit) for fit in starts]))


def near(
    fit: Fit,
    nothing: frozenset[tuple[object, ...]] = frozenset(),
    turns: int = 1,
    *,
    alone: bool = False,
) -> Fit:
    """A fit on columns about its estimates, where these lie far from those that it has."""
    for _ in range(turns):
        if not is_far(fit):
            break
        fit = settled(about(fit, nothing, alone=alone))
    return fit


def arrived(fit: Fit, nothing: frozenset[tuple[object, ...]] = frozenset()) -> Fit:
    """A fit on columns where steps of Newton's lead, of all that competes on its own.

    Steps need the columns of what stands alone, which take a fraction of the time.
    """
    first, moved = fit, frozenset[str]()
    for _ in range(_NEWTON):
        if not is_far(fit):
            break
        moved |= _parts_moved(fit)
        fit = settled(about(fit, nothing, alone=True))
    return settled(about(fit, nothing, since=(first.design, moved)))


def _alone(first: Fit) -> Fit | None:
    """The likeliest name where no common law stands beside it, then all beside it.

    A scale of a whole channel, say, is one name; laws at all joints together can look like it.
    """
    d = first.design
    laws = [k for k, t in enumerate(d.terms) if t.block and t.bound == np.inf]
    laws = [k for k in laws if d.terms[k].effect.name in COMMON]
    gone = frozenset(d.terms[k].identity for k in laws)
    bare = settled(first.lacking(laws))
    if d.model.known:  # where a log showed the laws before, all that has changed comes before more
        named: Fit | None = climbed(bare)
    else:
        named = _best(bare, [m for m in moves(bare) if m[1]][:_TRIED])
    if named is None:
        return None
    if is_far(named):
        named = arrived(named, gone)
    # The laws are nothing beside it until they are likelier.
    silent = {d.terms[k].block: NOTHING for k in laws}
    scales = {**named.scales, **silent}
    return settled(replace(named, omitted=frozenset(), scales=scales))


def _tied(fit: Fit) -> Fit:
    """Links whose bodies hardly differ are the files' again."""
    bounds = {t.block: t.bound for t in fit.design.terms if t.block}
    near = {b for b in fit.loose if fit.scale(b) < 2.0 * bounds[b]}
    return settled(replace(fit, loose=fit.loose - near)) if near else fit


def likeliest(fits: Sequence[Fit]) -> Fit:
    """The fit with the most evidence, all judged by the least independent samples of any."""
    kappa = np.min([f.kappa for f in fits], axis=0)
    judged = [settled(replace(f, kappa=kappa), _QUICK).worth for f in fits]
    return fits[int(np.argmax(judged))]


def polished(fit: Fit) -> Fit:
    """The likeliest set on columns about its own estimates.

    A set that is likelier on columns about another one may owe that to products of the two: a gain,
    say, scales the ripple about which its column was made.
    """
    best: Fit | None = None
    for _ in range(_ROUNDS):
        fit = settled(refreshed(fit))
        moved = is_far(fit) or any(fit.design.terms[k].free for k in fit.names)
        there = arrived(fit) if moved else fit
        if best is not None and likeliest([there, best]) is best:
            return best
        best, fit = there, climbed(there)
        if not moved or (keys_of(fit) == keys_of(there) and not is_far(fit)):
            return fit
    return likeliest([arrived(fit), best]) if best else fit


def keys_of(fit: Fit) -> frozenset[Key]:
    """Names of a fit."""
    return frozenset(fit.design.terms[k].key for k in fit.names)


def is_far(fit: Fit) -> bool:
    """Whether estimates lie so far from the point of the columns that these may have changed."""
    return bool(_far(fit))


def _far(fit: Fit) -> list[Term]:
    """Terms whose estimates lie so far from the point of the columns."""
    d, moved, out = fit.design, fit.x - fit.design.x0, []
    for k, term in enumerate(d.terms):
        own = moved[d.columns[k]]
        if isinstance(term.effect, BodyStrain) and np.abs(own).max(initial=0.0) > 0.1:
            out.append(term)
        if isinstance(term.effect, Slope) and (np.abs(own) > fit.spread[d.columns[k]]).any():
            out.append(term)
        if isinstance(term.effect, Effect) and not term.effect.additive:
            steps = np.array([c.step for c in term.effect.coordinates])
            bent = (np.abs(own) > BENT * steps).any()
            if bent and (np.abs(own) > fit.spread[d.columns[k]]).any():
                out.append(term)
    return out


# Steps on sums.


def climbed(fit: Fit) -> Fit:
    """The likeliest set that steps of one name reach."""
    for _ in range(6):
        better = settled(_swapped(_pruned(_grown(fit))))
        if keys_of(better) == keys_of(fit) and better.loose == fit.loose:
            return better
        fit = better
    return fit


def offered(fit: Fit, closed: frozenset[Key]) -> list[int]:
    """Terms that may become names beside those that are."""
    d, present = fit.design, keys_of(fit)
    pairs = {p for k in fit.names if couples(d.terms[k]) for p in d.terms[k].place}
    out = []
    for k, t in enumerate(d.terms):
        if t.block or t.key in present or t.key in closed:
            continue
        if not (couples(t) and pairs & set(t.place)):
            out.append(k)
    return out


def couples(term: Term) -> bool:
    """Whether it couples two joints."""
    return getattr(term.effect, "place_kind", "") == "joint pair"


def without(fit: Fit, number: int, *, alone: bool = False) -> Fit:
    """The same without a name; `alone`: as in `about`.

    Laws at a joint whose shaft is coupled act on the shared shaft: about a coupling, their columns
    hold it, so that columns are made anew where it leaves.
    """
    less = fit.without(number)
    return about(less, alone=alone) if couples(fit.design.terms[number]) else less


def moves(fit: Fit, closed: frozenset[Key] = frozenset()) -> list[Move]:
    """Names to add, but those that are closed, and links to let loose, the most promising first."""
    numbers = offered(fit, closed)
    gains = fit.gains(numbers)
    out: list[Move] = [
        (float(g), (*fit.names, k), fit.loose)
        for k, g in zip(numbers, gains, strict=True)
        if g > 0.0
    ]
    d, links = fit.design, len(fit.loose)
    price = d.loose_cost(links + 1) - d.loose_cost(links)
    for k, t in enumerate(d.terms):
        if isinstance(t.effect, BodyStrain) and t.block not in fit.loose:
            ids = d.columns[k]
            gain = max(fit.with_prior(ids, scale * d.unit[ids]) for scale in _FORESEEN) + price
            if gain > 0.0:
                out.append((gain, fit.names, fit.loose | {t.block}))
    return sorted(out, key=lambda move: -move[0])


def _taken(fit: Fit, move: Move) -> Fit:
    return settled(replace(fit, names=move[1], loose=move[2]), _QUICK)


def impossible(fit: Fit) -> list[int]:
    """Names that cannot be, or lack a coordinate that makes them this one."""
    d, out = fit.design, []
    for k in fit.names:
        term, x = d.terms[k], fit.x[d.columns[k]]
        effect = term.effect
        assert isinstance(effect, Effect)
        named = dict(zip(effect.coordinates, x.tolist(), strict=True))
        lacks = any(c.required and value == 0.0 for c, value in named.items())
        values = {c.name: value for c, value in named.items()}
        if isinstance(effect, TorqueRipple):  # a wave longer than the travel is none
            seen = d.data_sets[0].simulator.measured
            lacks = term.shape["order"] < effect.orders(seen, d.model.index(term.place[0])).min()
        if lacks or not effect.plausible(d.model, term.place, values, term.shape):
            out.append(k)
    return out


def _best(fit: Fit, of: Sequence[Move], least: float = NO_RISE) -> Fit | None:
    """The best of some moves in earnest, if it is better than staying by some evidence."""
    best = None
    for move in of:
        if best is not None and move[0] < FORESEES * of[0][0]:
            break
        other = _taken(fit, move)
        better = other.rise(best) > 0.0 if best else other.rise(fit) > least
        if better and not impossible(other):
            best = other
    return best


def _grown(fit: Fit) -> Fit:
    while better := _best(fit, moves(fit)[:_TRIED]):
        fit = _pruned(better)
    return fit


def removals(fit: Fit) -> Iterator[tuple[float, int]]:
    """Rise of the evidence without each name while scales and noise stay, and its number."""
    d = fit.design
    for k in fit.names:
        at = fit.among(d.whole(k))[1]
        ids = fit.active[at]
        S = np.linalg.inv(fit.covariance[np.ix_(at, at)])
        x = fit.x[ids]
        size = np.linalg.slogdet(S)[1] + 2.0 * np.log(fit.deviation[ids]).sum()
        yield float(0.5 * (size - x @ S @ x) - d.cost[k]), k


def _pruned(fit: Fit) -> Fit:
    while fit.names:
        wrong = impossible(fit)
        rise, worst = max(pair for pair in removals(fit) if not wrong or pair[1] in wrong)
        if not wrong and rise <= 0.0:
            return fit
        less = settled(without(fit, worst, alone=True), _QUICK)
        if fit.rise(less) >= 0.0 and not wrong:
            return fit
        fit = settled(without(fit, worst), _QUICK) if couples(fit.design.terms[worst]) else less
    return fit


def _swapped(fit: Fit) -> Fit:
    """Each name, and each loose link, against what may stand in its place."""
    for k in fit.names:
        if couples(fit.design.terms[k]):  # what stands about it would keep it
            continue
        less = fit.without(k)
        gains = {k in m[1]: m[0] for m in reversed(moves(less))}
        if gains.get(False, 0.0) < FORESEES * gains.get(True, 0.0):
            continue
        rest = settled(less, _QUICK)
        found = _best(fit, [m for m in moves(rest) if k not in m[1]][:2], BARE)
        if found is not None:
            return _swapped(_pruned(found))
    for block in sorted(fit.loose):
        rest = settled(replace(fit, loose=fit.loose - {block}), _QUICK)
        if fit.rise(rest) < 0.0:
            return _swapped(rest)
        found = _best(fit, [m for m in moves(rest) if block not in m[2]][:1], BARE)
        if found is not None:
            return _swapped(_pruned(found))
    return fit


# Columns about an answer.


def about(
    fit: Fit,
    omitted: frozenset[tuple[object, ...]] = frozenset(),
    *,
    alone: bool = False,
    since: tuple[Design, frozenset[str]] | None = None,
) -> Fit:
    """The same names on columns about their estimates, with other nonlinear parameters beside.

    Args:
        fit: Of whose values.
        omitted: Identities of terms that are nothing in it and are to stay so.
        alone: Whether names that do not stand are left away, which takes a fraction of the time.
        since: A design of all that competes, that of the fit by default, and what moved since it.
    """
    d = fit.design
    whole, moved = since or (d, frozenset())
    point = _point(fit)
    standing = {p.term.key: p.term for p in point if not p.term.block}
    names = {d.terms[k].key for k in fit.names}
    forms = {(d.terms[k].key, *d.terms[k].shape) for k in fit.names}
    coupled = {joint for t in standing.values() if couples(t) for joint in t.place}
    terms = [replace(standing.get(d.terms[k].key, d.terms[k]), reach=1.0) for k in fit.names]
    for t in whole.terms:
        closed = alone or (t.key, *t.shape) in forms or (couples(t) and coupled & set(t.place))
        if not isinstance(t.effect, Slope) and (t.block or not closed):
            terms.append(t)
    varied = []
    for key in names:
        term = standing.get(key)
        for name, value in (term.free if term else {}).items():
            assert term is not None
            if name not in ("x", "y", "z", "order") and not alone:
                varied += [replace(term, shape={**term.shape, name: f * value}) for f in _VARIED]
            step = max(1e-3 * abs(value), 1e-6)
            unit = 0.1 if name in ("x", "y", "z") else 0.3 * abs(value) + 1e-6
            slope = Slope(key[0], name, step)
            terms.append(Term(slope, key[1], block=f"slope {key} {name}", bound=1.0, unit=(unit,)))
    moved |= _parts_moved(fit)
    design = make_design(d.model, d.data_sets, [*terms, *varied], point, whole, moved)
    if alone:
        design = replace(design, kept_of=d.competing)
    number = {t.identity: k for k, t in enumerate(design.terms)}
    now = [standing.get(d.terms[k].key, d.terms[k]) for k in fit.names]
    kept = [number[t.identity] for t in now if t.identity in number]
    blocks = {t.block for t in design.terms if t.block}
    scales = {b: fit.scale(b) for b in blocks}
    gone = [k for k, t in enumerate(design.terms) if t.identity in omitted]
    same = replace(
        fit, design=design, names=tuple(kept), scales=scales, omitted=frozenset(), negative=None
    )
    return same.lacking(gone)


def _parts_moved(fit: Fit) -> frozenset[str]:
    return frozenset(part for t in _far(fit) for part in parts_of(t.place))


def _point(fit: Fit) -> list[Placed]:
    """Terms at estimates, or a share of the way to them where all leads astray."""
    d = fit.design
    aim, promised = _curved(fit)
    far = np.where([isinstance(d.terms[k].effect, BodyStrain) for k in d.owner], STEP, np.inf)
    # What does not stand, and bodies that are the files' again, go at once: they may be all that
    # another answer was made of.
    tied = [isinstance(t.effect, BodyStrain) and t.block not in fit.loose for t in d.terms]
    goes = np.array(tied, np.bool_)[d.owner] | ~np.isin(np.arange(d.size), fit.active)
    origin = np.where(goes, aim, d.x0)
    start = float(fit.weights @ _squares(d, origin))
    best: tuple[float, list[Placed]] | None = None
    for share in _SHARES:
        x = origin + share * np.clip(aim - origin, -far, far)
        slopes = {
            (t.effect.effect, t.place, t.effect.parameter): float(x[c][0])
            for t, c in zip(d.terms, d.columns, strict=True)
            if isinstance(t.effect, Slope)
        }
        placed = []
        every = [k for k, t in enumerate(d.terms) if not isinstance(t.effect, Slope)]
        for p in d.placed(x, every):
            shape = dict(p.term.shape)
            for name in p.term.free:
                moved = slopes.get((*p.term.key, name), 0.0)
                most = 0.1 if name in ("x", "y", "z") else 0.3 * abs(shape[name])
                shape[name] += float(np.clip(moved, -most, most))
            placed.append(replace(p, term=replace(p.term, shape=shape)))
        loss = _loss_at(fit, placed)
        if best is None or loss < best[0]:
            best = loss, placed
            if loss <= promised + STRAIGHT * (start - promised) + NO_RISE:
                break  # as foreseen
        elif share < 0.5:
            break
    assert best is not None
    return best[1]


def _curved(fit: Fit) -> tuple[Array, float]:
    """Estimates (K,) where bodies are as they are at these, and the weighted squares then left.

    Torques are linear in a body's ten inertial parameters and not in its strain: a linear estimate
    goes far along what a motion hardly shows to make up for the bend of what it shows. Damped steps
    on the sums (Marquardt, J. SIAM 11, 1963).
    """
    d, ids, here = fit.design, fit.active, fit.design.predictions[0].model
    bent = []
    for t, c in zip(d.terms, d.columns, strict=True):
        live, at = fit.among(c)
        if isinstance(t.effect, BodyStrain) and t.block in fit.loose and live.size == c.size:
            ten = inertial(here, t.place[0])
            bent.append((at, d.x0[c], ten, np.linalg.pinv(slope(ten, d.x0[c]))))
    if not bent:
        return fit.x, float(fit.weights @ fit.misfit)
    (H, h), square = fit.sums, float(fit.weights @ d.totals[0])

    def seen(x: Array) -> tuple[Array, float, float]:
        """Values that give the same torque by the columns, squares left, and with the prior's."""
        u = x.copy()
        for at, x0, ten, back in bent:
            u[at] = x0 + back @ (ten(x[at]) - ten(x0))
        left = float(square - 2.0 * h @ u + u @ H @ u)
        return u, left, left + float(fit.prior @ x**2)

    x, damping, out = d.x0[ids], 1e-6, np.zeros(d.size)
    u, left, loss = seen(x)
    for _ in range(_DAMPED):
        J = np.eye(ids.size)
        for at, _, ten, back in bent:
            J[np.ix_(at, at)] = back @ slope(ten, x[at])
        A, b = J.T @ H @ J + np.diag(fit.prior), J.T @ (h - H @ u) - fit.prior * x
        before = loss
        while damping < _STIFF and loss >= before:
            other = x + np.linalg.solve(A + damping * np.diag(np.diag(A)), b)
            there = seen(other)
            if there[2] < before:
                x, (u, left, loss) = other, there
            damping *= 0.1 if loss < before else 10.0
        if before - loss < NO_RISE:
            break
    out[ids] = x
    return out, left


def _squares(d: Design, x: Array) -> Array:
    """What a design's equations leave at values (K,), shape (E,)."""
    return np.array([np.sum(e.left(x)[e.chunk >= 0] ** 2) for e in d.equations])


def _loss_at(fit: Fit, placed: Sequence[Placed]) -> float:
    """Weighted squared residual of the model with some terms."""
    d = fit.design
    model = placed_in(d.model, placed)
    every = [left_at(s, model, d.equations) for s in d.data_sets]
    loss = 0.0
    for e, w, *rest in zip(d.equations, fit.weights, *every, strict=True):
        loss += w * float(np.sum(np.concatenate(rest)[e.chunk >= 0] ** 2))
    return loss
