"""From the likeliest names to the answer: which are told, their values, how sure, against what.

A number is told where the evidence against nothing passes, chunks of the log that were left out
miss it, and its interval leaves zero. What is not told is nothing in the model file, and the others
are estimated without it. Each name is then taken out, and what may stand in its place estimated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.stats import chi2

from actuators.arrays import Array, Index
from pipeline.effects.base import EFFECTS, Effect, told_apart
from pipeline.effects.bodies import NAMES
from pipeline.effects.model_file import Edit, EditParameter
from pipeline.identification import results as limits
from pipeline.identification.design import Key, make_data_sets
from pipeline.identification.fit import Fit, settled
from pipeline.identification.general import has_general, kept_kinds, with_general
from pipeline.identification.residual import floor_of, noise_left
from pipeline.identification.results import Candidate, Found
from pipeline.identification.search import (
    Move,
    about,
    couples,
    is_far,
    moves,
    near,
    offered,
    polished,
    searched,
    without,
)
from pipeline.identification.settings import (
    COLOURED,
    COVER,
    EXCLUDED,
    FAR_BEHIND,
    LARGEST_CLASS,
    LAW,
    LOOSE,
    SHARE,
    SHARED,
    SURE,
    TWIN,
)
from pipeline.identification.tolerances import BodyStrain, Slope
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel, strained

#: The bodies of all links as one name.
BODIES: Final[Key] = (BodyStrain.name, ())
#: Draws of the estimates from which intervals of what follows from them are taken.
_DRAWS: Final = 200
_SEED: Final = 20240613
#: Rivals of a name that are estimated in earnest.
_RIVALS: Final = 4
#: Rivals of a name of the search that are estimated whatever is foreseen of them.
_TRIED: Final = 4
#: Times that columns are made anew about a rival.
_ABOUT: Final = 3
#: Times that a rival that turns out likelier is followed.
_FOLLOWED: Final = 2
#: Of what does not stand, one in so many goes before the rest is judged anew.
_SLOWLY: Final = 4
#: Laws of friction of which any curve over the speed has a part.
_FRICTION: Final = ("coulomb_friction", "viscous_friction", "load_dependent_friction")
#: Laws that a body of the same joint may look like.
_LIKE_BODIES: Final = ("rotor_inertia", "effort_offset")
#: Turns of the estimate without a name.
_ANEW: Final = 5
#: Times that columns are made anew about what is told.
_TURNS: Final = 2


@dataclass(frozen=True)
class Told:
    """One name: a term that stands, or the bodies of links."""

    key: Key
    terms: tuple[int, ...]  #: Its terms: one, or those of the bodies.
    against_nothing: float  #: Evidence that it brings (logarithm).
    sure: float  #: Standard errors by which left-out chunks miss it.
    share: float  #: Of what is left at its joints, that its absence adds there.
    certain: bool  #: Whether its interval leaves zero.
    priced: bool  #: Whether the search took it as a name, so that it is listed whatever it is.
    apart: bool = True  #: Whether left-out chunks miss it where the others are estimated anew.

    @property
    def stands(self) -> bool:
        """Whether it is told."""
        return (
            self.against_nothing > 0.0 and self.sure > SURE and self.share > SHARE and self.certain
        )


@dataclass(frozen=True, eq=False)
class Answer:
    """What is told of a searched set of names."""

    fit: Fit  #: With what is told alone.
    found: Fit  #: From `searched`, with everything, which intervals allow for.
    told: tuple[Told, ...]  #: Those that do most first.
    suspected: tuple[Told, ...]  #: Names of the search that are not told, as they were.

    @cached_property
    def draws(self) -> Array:
        """Deviations of all columns by what is not known, shape (D, K)."""
        rng = np.random.default_rng(_SEED)
        fit = self.fit
        L = np.linalg.cholesky(fit.covariance + 1e-300 * np.eye(fit.active.size))
        own = np.sqrt(np.diag(fit.covariance))
        out = np.zeros((_DRAWS, fit.design.size))
        wide, before = self.found.design, np.zeros(fit.design.size)
        number = {t.identity: c for t, c in zip(wide.terms, wide.columns, strict=True)}
        for term, columns in zip(fit.design.terms, fit.design.columns, strict=True):
            if term.identity in number:  # columns may have been made anew since
                before[columns] = self.found.spread[number[term.identity]]
        spread = np.maximum(fit.spread, before)[fit.active]
        values = rng.standard_normal((_DRAWS, fit.active.size)) @ L.T
        out[:, fit.active] = values * (spread / np.maximum(own, 1e-300))
        return out


def answered(found: Fit, allowed: frozenset[Key] | None = None) -> Answer:
    """Decide what is told.

    Args:
        found: From `searched`.
        allowed: The only names that may be told; any by default.
    """
    fit = found
    suspected: set[Key] = set()
    turns = _TURNS
    while True:
        d, told = fit.design, list(_judged(fit))
        out = [t for t in told if not t.stands or (allowed is not None and t.key not in allowed)]
        if not out:
            if not turns or not (is_far(fit) or _without_slopes(fit)):
                break
            # Bodies that moved far are judged on columns about where they are, and nonlinear
            # parameters have their uncertainty by how the columns move with them.
            turns -= 1
            fit = settled(about(fit, _nothing(fit)))
            continue
        # What may not be told goes first, then names, then numbers of laws that all joints have,
        # each judged beside the others: two that stand in for each other must not go at once.
        barred = [t for t in out if allowed is not None and t.key not in allowed]
        order = sorted(out, key=lambda t: (not t.priced, t.against_nothing))
        out = barred or order[: max(1, len(out) // _SLOWLY)]
        suspected |= {t.key for t in out if t.priced}
        gone = {k for t in out for k in t.terms}
        if any(t.key == BODIES for t in out):
            fit = replace(fit, loose=frozenset())
        laws = [k for k in gone if d.terms[k].block and d.terms[k].key[0] != BODIES[0]]
        kept = tuple(k for k in fit.names if k not in gone)
        if kept != fit.names:  # what was nothing beside a name that goes may be what it stood for
            fit = replace(fit, names=kept, omitted=frozenset())
        fit = fit.lacking(laws)
        if any(couples(d.terms[k]) for k in gone):
            fit = about(fit, _nothing(fit))
        fit = settled(fit)
    told = sorted(
        (t for t in told if t.stands), key=lambda t: (not _on_stated(t.key), -t.against_nothing)
    )
    judged = _judged(found, only=frozenset(suspected)) if suspected else ()
    left = tuple(t for t in judged if t.priced)
    return Answer(fit, found, tuple(told), left)


def _without_slopes(fit: Fit) -> bool:
    """Whether a nonlinear parameter of a name has no column by which it is known."""
    terms = fit.design.terms
    known = {t.moves for t in terms}
    return any(terms[k].free and terms[k].key not in known for k in fit.names)


def _on_stated(key: Key) -> bool:
    """Whether a name changes what the files state: a model file has it before what is added."""
    return key[0] in EFFECTS and EFFECTS[key[0]].on_stated


def _nothing(fit: Fit) -> frozenset[tuple[object, ...]]:
    """Identities of terms that are left out."""
    pairs = zip(fit.design.terms, fit.design.columns, strict=True)
    return frozenset(t.identity for t, c in pairs if c.size and set(c.tolist()) <= fit.omitted)


def _judged(fit: Fit, *, anew: bool = True, only: frozenset[Key] | None = None) -> Iterator[Told]:
    """Every name and every number of the common laws, and the bodies that are loose.

    Args:
        fit: With them.
        anew: Whether columns can be made anew, of terms that a model can have.
        only: Those that are asked for; all by default.
    """
    d = fit.design
    live = set(fit.active.tolist())
    # What a joint's own body as wrong as it may be would take over is that body's: all of a rotor's
    # inertia, while other bodies would have to change what they do at other joints.
    wide = {
        joint: replace(fit, scales={**fit.scales, f"body {link}": LOOSE})
        for link, joint in d.model.robot.links.items()
        if f"body {link}" in fit.loose
    }
    for k, term in enumerate(d.terms):
        columns = d.columns[k][[c in live for c in d.columns[k].tolist()]]
        priced = k in fit.names
        common = bool(term.block) and term.bound == np.inf and isinstance(term.effect, Effect)
        if not columns.size or not (priced or common) or not (only is None or term.key in only):
            continue
        alike = term.effect.name in _LIKE_BODIES and not priced
        cost = d.cost[k] if priced else d.name_cost
        one = _weighed(
            wide.get(term.place[0], fit) if alike else fit, term.key, (k,), columns, cost, priced
        )
        if priced and (anew or not couples(term)):
            # Signs may hold what would stand in its place: the others as they are without it.
            less = settled(without(fit, k, alone=True), _ANEW)
            sure, share = fit.sure(less, d.touched(k))
            rise = fit.rise(less)
            if couples(term) or d.within(k):  # laws that it has in it, or acts on, stand without it
                one = replace(one, against_nothing=rise, sure=sure, share=share)
            if couples(term):
                one = replace(one, certain=_can_be(fit, k))
            else:
                apart = sure > SURE and share > SHARE
                one = replace(one, against_nothing=min(rise, one.against_nothing), apart=apart)
        yield one
    # Where one is loose, all are told: the file lacks nothing that the estimate has.
    bodies = [k for k, t in enumerate(d.terms) if isinstance(t.effect, BodyStrain)]
    if fit.loose and (only is None or BODIES in only):
        tied = settled(replace(fit, loose=frozenset()), 5)
        touched = sorted({e for k in bodies for e in d.touched(k)})
        # What is not told is the files', which a tight prior leaves where the log insists.
        files = settled(tied.lacking(bodies), 5)
        sure, share = fit.sure(files, touched)
        rise = fit.rise(tied)
        yield Told(BODIES, tuple(bodies), rise, sure, share, True, True)


def _weighed(
    fit: Fit, key: Key, terms: tuple[int, ...], columns: Index, cost: float, priced: bool
) -> Told:
    d = fit.design
    # What moves with its nonlinear parameters goes with a name.
    own = d.whole(terms[0]) if priced else columns
    live, at = fit.among(own)
    every = own[live]
    x, spread = fit.x[every], fit.spread[every]
    S = fit.covariance[np.ix_(at, at)]
    grow = spread / np.sqrt(np.diag(S))
    S = S * np.outer(grow, grow)
    prior = fit.deviation[every]
    first = slice(0, columns.size)
    prior[first] = d.tail(columns, x[first])
    wald = float(x @ np.linalg.solve(S, x))
    size = np.linalg.slogdet(S)[1] - 2.0 * np.log(prior).sum()
    size -= 2.0 * np.log(prior[first] / d.narrow[columns]).sum()
    sure, share = fit.sure(every, d.touched(terms[0]))
    mine = float(x[first] @ np.linalg.solve(S[first, first], x[first]))
    certain = mine > float(chi2.isf(0.05, columns.size)) and _required(fit, terms[0])
    certain = certain and _can_be(fit, terms[0])
    return Told(key, terms, 0.5 * (wald + size) + cost, sure, share, certain, priced)


def _can_be(fit: Fit, number: int) -> bool:
    """Whether an effect takes its estimate: the last one may have left what the search allows."""
    effect = fit.design.terms[number].effect
    values = _physical(fit, number, np.zeros(fit.design.size))
    stated = [p for p in EFFECTS[effect.name].parameters if p.name in values]
    return all(p.low <= values[p.name] <= p.high for p in stated)


def _required(fit: Fit, number: int) -> bool:
    """Whether each coordinate that makes an effect this one leaves zero."""
    d = fit.design
    effect = d.terms[number].effect
    return all(
        abs(fit.x[c]) > COVER * fit.spread[c]
        for c, one in zip(d.columns[number], effect.coordinates, strict=True)
        if one.required
    )


# Values.


def found_of(answer: Answer, one: Told, order: int) -> Found:
    """A told name as it is reported; a body that is the file's is none of them."""
    terms, columns = answer.fit.design.terms, answer.fit.design.columns
    edits = [
        Edit(effect=one.key[0], place=terms[k].place, parameters=_parameters(answer, k))
        for k in one.terms
        if one.key != BODIES or answer.fit.x[columns[k]].any()
    ]
    return Found(order=order, edits=tuple(edits))


def _parameters(answer: Answer, number: int) -> tuple[EditParameter, ...]:
    """Parameters of a term with intervals by draws, no narrower than laws hold."""
    d = answer.fit.design
    effect = EFFECTS[d.terms[number].effect.name]
    best = _physical(answer.fit, number, np.zeros(d.size))
    drawn = [_physical(answer.fit, number, deviation) for deviation in answer.draws]
    channel, out = d.data_sets[0].measurement.channels[0], []
    for p in (p for p in effect.parameters if p.name in best):
        value, every = best[p.name], np.array([x[p.name] for x in drawn])
        if p.name == "phase":  # an angle: so that it does not wrap inside the interval
            every = value + (every - value + np.pi) % (2 * np.pi) - np.pi
        low, high = np.quantile(every, (0.025, 0.975))
        law = effect.name != BODIES[0] and p.name not in ("phase", "order")
        wider = COVER * LAW * abs(value) * law
        low, high = value - np.hypot(value - low, wider), value + np.hypot(high - value, wider)
        ends = min(max(float(low), p.low), value), max(min(float(high), p.high), value)
        unit = effect.unit(p.name, channel)
        out.append(EditParameter(name=p.name, value=value, unit=unit, interval=ends))
    return tuple(out)


def _physical(fit: Fit, number: int, deviation: Array) -> dict[str, float]:
    """Parameters of a term where all columns deviate from their estimates, (K,)."""
    d = fit.design
    term, x = d.terms[number], fit.x + deviation
    if isinstance(term.effect, BodyStrain):
        rigid = d.model.robot.model
        body = rigid.inertias[rigid.getJointId(d.model.carrier(term.place[0]))]
        moved = strained(body, x[d.columns[number]].tolist()).toDynamicParameters()
        return dict(zip(NAMES, moved.tolist(), strict=True))
    assert isinstance(term.effect, Effect)
    shape = dict(term.shape)
    for k, t in enumerate(d.terms):
        slope = t.effect
        if isinstance(slope, Slope) and t.moves == term.key:
            shape[slope.parameter] += float(x[d.columns[k]][0])
    pairs = zip(term.effect.coordinates, x[d.columns[number]].tolist(), strict=True)
    return term.effect.physical({c.name: v if c.signed else max(v, 0.0) for c, v in pairs}, shape)


# Against what.


@dataclass(frozen=True)
class Rival:
    """What may stand in the place of a name."""

    key: Key
    behind: float  #: Logarithm of how much less likely the log is with it, at least.
    ahead: float  #: ... and how much likelier, at least.
    excluded: bool  #: Whether the log excludes it.
    fewer: bool  #: Whether it has fewer numbers.
    fit: Fit  #: With it, on the columns of the answer.


def rivals_of(answer: Answer, one: Told) -> list[Rival]:
    """What explains the log nearly as well in the place of a name, each estimated."""
    fit, d = answer.fit, answer.fit.design
    names = tuple(k for k in fit.names if k not in one.terms)
    less = replace(fit, names=names)
    bodies = one.key == BODIES
    less = settled(replace(less, loose=frozenset()) if bodies else less.lacking(one.terms), 5)
    out: list[Rival] = []
    likely, alike = _foreseen(less, fit, one)
    for move, far in [*((m, FAR_BEHIND) for m in likely), *((m, np.inf) for m in alike)]:
        added = [k for k in move[1] if k not in names]
        key = d.terms[added[0]].key if added else BODIES
        if any(r.key == key for r in out):
            continue
        other = settled(replace(less, names=move[1], loose=move[2]), 5)
        if added and not couples(d.terms[added[0]]) and not _required(other, added[0]):
            continue  # without its main size it is another name
        linear, behind = other, fit.rise(other)
        for _ in range(_ABOUT):  # with what is not linear, as the winner was
            if behind >= far or not is_far(other):
                break
            other = near(other, _nothing(other), alone=True)
            # What has not come half the way by a step of Newton's does not arrive.
            far = far if far == np.inf else max(0.5 * behind, 2.0 * EXCLUDED)
            behind = fit.rise(other)
        # What fits as well differs in the sizes that things have, and in numbers no log sees.
        twin = _unlike(other, fit.weights) - _unlike(fit, fit.weights) < TWIN
        touched = sorted({e for k in one.terms for e in d.touched(k)})
        richer = other.active.size > fit.active.size
        apart = richer or fit.sure(other, touched)[0] > SURE
        if twin or behind < 2.0 * EXCLUDED:
            excluded = behind > EXCLUDED and apart and not twin
            fewer = other.active.size < fit.active.size
            out.append(Rival(key, behind, other.rise(fit), excluded, fewer, linear))
    out += _traded(less, fit, one)
    out.sort(key=lambda r: r.behind)
    open_ = [r for r in out if not r.excluded][:LARGEST_CLASS]
    return [r for r in out if r.excluded or r in open_]


def _traded(less: Fit, fit: Fit, one: Told) -> Iterator[Rival]:
    """Names that the log shows beside the files' bodies and that those of the answer take over.

    Of a scale and the body of a pendulum, say, a log shows the product. Laws of links are bodies.

    Args:
        less: The fit without the name.
        fit: With it.
        one: A name that changes bodies; any other has none.
    """
    d, held, links = fit.design, replace(less, sigma=fit.sigma), fit.design.model.robot.links
    changed = _loose(fit) if one.key == BODIES else {p for p in one.key[1] if p in links}
    if not changed:
        return
    # All joints have such laws: they cost nothing.
    laws = [k for k, t in enumerate(d.terms) if t.block and t.effect.name in _LIKE_BODIES]
    at = {(links[link],) for link in changed}
    laws = [k for k in laws if d.terms[k].place in at and not fit.x[d.columns[k]].any()]
    numbers = [k for k in offered(fit, frozenset()) if d.terms[k].place[0] not in links]
    gains = [*fit.gains(numbers).tolist(), *(0.0 for _ in laws)]
    for k, gain in zip([*numbers, *laws], gains, strict=True):
        columns = d.columns[k]
        # As large as in practice.
        shown, left = (f.beside(columns, d.narrow[columns]) for f in (held, fit))
        if left < (SHARE * shown if k in laws else 1.0) and shown > COVER**2:
            more = fit if k in laws else replace(fit, names=(*fit.names, k))
            yield Rival(d.terms[k].key, -gain, gain, False, False, more)


def _loose(fit: Fit) -> set[str]:
    """Links whose bodies may be anything."""
    return {t.place[0] for t in fit.design.terms if t.block in fit.loose}


def _foreseen(less: Fit, fit: Fit, one: Told) -> tuple[list[Move], list[Move]]:
    """What is estimated in the place of a name: the likeliest, then what gives its torque.

    Args:
        less: The fit without it.
        fit: With it.
        one: The name.
    """
    d, bodies = fit.design, one.key == BODIES
    # Laws with more numbers that have it in them fit whatever the log says.
    general = [k for k in range(len(d.terms)) if not set(one.terms).isdisjoint(d.within(k))]
    closed = frozenset({one.key}) | {d.terms[k].key for k in general}
    likely = [m for m in moves(less, closed) if not bodies or m[2] == less.loose]
    # What is foreseen on the noise of a fit that lacks the name says little of its rivals.
    least = fit.evidence - less.evidence - 2.0 * EXCLUDED
    few = _TRIED if one.priced else 0
    likely = [m for k, m in enumerate(likely[:_RIVALS]) if k < few or m[0] > least]
    columns, numbers = d.of(one.terms), offered(less, closed)
    x, shares = fit.x[columns], less.shares(numbers, columns, fit.x[columns]).tolist()
    twins: list[Move] = [
        (share, (*less.names, k), less.loose) for share, k in zip(shares, numbers, strict=True)
    ]
    for block in {t.block for t in d.terms if isinstance(t.effect, BodyStrain) and not bodies}:
        wide = replace(less, loose=less.loose | {block}, scales={**less.scales, block: LOOSE})
        share = 1.0 - wide.beside(columns, x) / less.beside(columns, x)
        twins.append((share, less.names, wide.loose))
    # Whatever else changes a loose link is a body of that kind.
    loose = _loose(fit) if bodies else set[str]()
    kinds = {k for k in numbers if not loose.isdisjoint(d.terms[k].place)}
    twins = [m for m in twins if m[0] > SHARED or kinds & set(m[1])]
    twins.sort(key=lambda m: -m[0])
    return likely, twins[:_RIVALS]


def _unlike(fit: Fit, weights: Array) -> float:
    """Half the weighted squares that a fit leaves, and those of what stays in every estimate."""
    d = fit.design
    free = set(d.of(fit.names).tolist())
    free |= {int(c) for k, t in enumerate(d.terms) if t.block in fit.loose for c in d.columns[k]}
    stays = np.array([c for c in fit.active.tolist() if c not in free], int)
    stretched = float(np.sum((fit.x[stays] / fit.deviation[stays]) ** 2))
    return 0.5 * (float(weights @ fit.misfit) + stretched)


def words_of(key: Key) -> str:
    """An effect and its place."""
    effect, place = key
    return f"{effect} at {' with '.join(place)}" if place else effect


# The whole.


@dataclass(frozen=True, eq=False)
class Identified:
    """Names with what they lead to."""

    found: tuple[Found, ...]  #: Those that do most first.
    candidates: tuple[Candidate, ...]  #: Every candidate once.
    answer: Answer
    noise: Array  #: Noise that no motion makes and what estimates leave open, shape (J, C).

    def alone(self, found: Sequence[Found]) -> tuple[Found, ...]:
        """Some of what was found with values as they are without the rest."""
        kept = frozenset(_key_of(f) for f in found)
        if kept >= {t.key for t in self.answer.told}:
            return tuple(found)
        again = replace(answered(self.answer.fit, kept), found=self.answer.found)
        by_key = {t.key: t for t in again.told}
        out = []
        for f in found:
            if _key_of(f) in by_key:
                f = replace(f, edits=found_of(again, by_key[_key_of(f)], f.order).edits)
            out.append(f)
        return tuple(out)


def _key_of(f: Found) -> Key:
    return BODIES if f.effect == BODIES[0] else f.key


def identify(model: MachineModel, measurements: Sequence[Log]) -> Identified:
    """Name what the model lacks, with values, intervals, rivals and how sure.

    Args:
        model: What the engineer has.
        measurements: Logs with parts, from `observe`.

    Raises:
        LegwattError: A part of the data has no usable row. Model and logs do not fit.
    """
    data_sets = make_data_sets(measurements)
    answer = answered(searched(model, data_sets, floor_of(measurements)))
    answer, known = _likeliest(answer)
    beside = _beside_general(answer)
    if beside.better:  # the others as they are without
        d, gone = answer.found.design, beside.better
        # A law that they have in them may be a part of what has no name.
        numbers = [k for k, t in enumerate(d.terms) if t.key in gone and not t.block]
        inside = {d.terms[w].key for k in numbers for w in d.within(k)}
        kept = frozenset(t.key for t in answer.told) | inside
        answer = answered(answer.found, kept - gone)
        known = {one.key: rivals_of(answer, one) for one in answer.told}
        beside = replace(_beside_general(answer), better=beside.better)
    noise, open_ = noise_left(answer.fit, floor_of(measurements))
    answer, within = _with_bodies(answer, np.hypot(noise, open_))
    if within:
        known |= {one.key: rivals_of(answer, one) for one in answer.told}
    fit, d = answer.fit, answer.fit.design
    left = np.array([np.sqrt(m / e.total[3]) for m, e in zip(fit.misfit, d.equations, strict=True)])
    tells = beside.takes if has_general(d) else {e.joint for e in d.equations}
    more = [
        e.joint
        for e, x in zip(d.equations, left / fit.floor, strict=True)
        if x > COLOURED or (x > limits.UNEXPLAINED and e.joint in tells)
    ]
    found: list[Found] = []
    close: dict[Key, Found] = {}
    for order, one in enumerate(answer.told, start=1):
        twins = tuple(r.key for r in known[one.key] if not r.excluded)
        much = "a part of that" if one.key == BODIES else "the log"
        doubts = [f"{'; '.join(map(words_of, twins))} would explain {much} as well"] * bool(twins)
        doubts += [limits.MORE_LEFT] * bool(_joints(fit, one) & set(more))
        doubts += [limits.OTHERS] * (not one.apart)
        doubts += [limits.BESIDE] * (one.key in beside.part)
        doubts += [limits.WITHIN] * (within and one.key == BODIES)
        level, reason = (limits.APPROXIMATE, doubts[0]) if doubts else (limits.CONFIRMED, "")
        f = found_of(answer, one, order)
        found.append(replace(f, level=level, reason=reason, rivals=twins))
        close |= {key: found[-1] for key in twins if key not in close}
    for one in answer.suspected:
        if not all(_can_be(answer.found, k) for k in one.terms):
            continue
        f = found_of(replace(answer, fit=answer.found), one, len(found) + 1)
        reason = limits.UNNAMED if one.key in beside.better else limits.NOTHING
        found.append(replace(f, level=limits.SUSPECTED, reason=reason))
    every = tuple(_candidates(answer, found, close))
    return Identified(tuple(found), every, answer, np.hypot(noise, open_))


def _likeliest(answer: Answer) -> tuple[Answer, dict[Key, list[Rival]]]:
    """An answer, or what stands in the place of one of its names where that is likelier.

    With fewer numbers anything likelier does. What has been left is not come back to.

    Returns:
        The answer and the rivals of its names.
    """
    left = set[Key]()
    for turn in range(_FOLLOWED + 1):
        rivals = {one.key: rivals_of(answer, one) for one in answer.told}
        every = [(r, t.key) for t in answer.told for r in rivals[t.key]]
        ahead = [pair for pair in every if pair[0].key not in left]
        best, gone = max(ahead, key=lambda pair: pair[0].ahead, default=(None, BODIES))
        if best is None or best.ahead < (0.0 if best.fewer else EXCLUDED) or turn == _FOLLOWED:
            break
        left.add(gone)
        again = answered(polished(settled(about(best.fit, _nothing(best.fit)))))
        if best.ahead < EXCLUDED and best.key not in {t.key for t in again.told}:
            break
        answer = again
    return answer, rivals


def _with_bodies(answer: Answer, noise: Array) -> tuple[Answer, bool]:
    """An answer whose file predicts what so far only tolerances explain, by bodies in their place.

    Encoder zeros, tight bodies and laws that are too small to be told may share a torque so that
    none of them is missed, and the file that holds none of them leaves it.

    Args:
        answer: What is told.
        noise: Up to some multiple of it nothing is unexplained, shape (J, C).

    Returns:
        The answer and whether it is another one.
    """
    fit, d, before = answer.fit, answer.fit.design, _as_written(answer)
    level = np.array([e.level(noise) for e in d.equations])
    least = np.sqrt(fit.misfit / [e.total[3] for e in d.equations])
    bodies = frozenset(t.block for t in d.terms if isinstance(t.effect, BodyStrain))
    known = (before <= limits.UNEXPLAINED * level).all() or (least > COLOURED * level).any()
    if known or bodies == fit.loose:
        return answer, False
    stays = {k for one in answer.told for k in one.terms}
    taken = [k for k, t in enumerate(d.terms) if t.block and k not in stays]
    taken = [k for k in taken if d.terms[k].block == "zeros" or d.terms[k].bound == np.inf]
    again = answered(near(settled(replace(fit, loose=bodies).lacking(taken))))
    likely = again.fit.evidence > fit.evidence - EXCLUDED
    better = likely and (_as_written(again) < before).all()
    return (again, True) if better and BODIES in {t.key for t in again.told} else (answer, False)


def _as_written(answer: Answer) -> Array:
    """Root mean square that what is told leaves of every equation, shape (E,)."""
    d, x = answer.fit.design, np.zeros(answer.fit.design.size)
    told = d.of([k for one in answer.told for k in one.terms])
    x[told] = answer.fit.x[told]
    left = [e.left(x)[e.chunk >= 0] for e in d.equations]
    return np.array([np.sqrt(np.mean(rest**2)) for rest in left])


@dataclass(frozen=True)
class Beside:
    """Names beside the general member."""

    part: frozenset[Key]  #: Those that do not stand beside it.
    better: frozenset[Key]  #: Those in whose place it explains the log better.
    takes: frozenset[int]  #: Joints at which it takes anything.


def _beside_general(answer: Answer) -> Beside:
    """Each joint's names beside the general member there, and it in the place of each.

    Friction is a part of any curve of friction; all other names are no part of a curve.
    """
    fit, d = answer.fit, answer.fit.design
    part, better, takes = set[Key](), set[Key](), set[int]()
    for joint in {e.joint: None for e in d.equations} if has_general(d) else ():
        beside = with_general(fit, joint)
        if beside.design.size == d.size:
            continue
        own = [t for t in answer.told if joint in _joints(fit, t)]
        single = [t for t in own if t.key[0] not in _FRICTION and len(_joints(fit, t)) == 1]
        # Together they may be pieced together to a curve that none of them is.
        for some_of in [*([t] for t in single), *([single] if len(single) > 1 else [])]:
            terms = [k for t in some_of for k in t.terms]
            names = tuple(k for k in fit.names if k not in terms)
            less = settled(replace(beside, names=names).lacking(terms), 5)
            if less.evidence > fit.evidence + EXCLUDED:
                better |= {t.key for t in some_of}
        beside, some = kept_kinds(beside, len(d.terms))
        if some:
            takes.add(joint)
            keys = frozenset(t.key for t in own if len(_joints(fit, t)) == 1)
            part |= {t.key for t in _judged(beside, anew=False, only=keys) if not t.stands}
    # A constant is the mean of any curve.
    better |= {key for key in part if key[0] == "effort_offset"}
    return Beside(frozenset(part), frozenset(better), frozenset(takes))


def _joints(fit: Fit, one: Told) -> set[int]:
    return {fit.design.equations[e].joint for k in one.terms for e in fit.design.touched(k)}


def _candidates(
    answer: Answer, found: Sequence[Found], close: dict[Key, Found]
) -> Iterator[Candidate]:
    """Every name once: those found, what comes close to one of them, then all others."""
    wide = answer.found
    d, weighed = wide.design, wide.weights @ wide.design.squares
    seen: dict[Key, bool] = {}
    for t, columns in zip(d.terms, d.columns, strict=True):
        if not t.block or (t.bound == np.inf and isinstance(t.effect, Effect)):
            # As large as in practice it changes the log by more than its noise.
            shown = (weighed[columns] * d.narrow[columns] ** 2 > 1.0).any()
            seen[t.key] = bool(shown) or seen.get(t.key, False)
    kept = {_key_of(f): f for f in found if f.kept}
    for key in dict.fromkeys([*kept, *close, *seen]):
        f = kept.get(key)
        if f is not None:
            verdict, reason = limits.ACCEPTED, f.reason or "nothing else explains the log as well"
        elif key in close:
            verdict = limits.INDISTINGUISHABLE + words_of(_key_of(close[key]))
            reason = told_apart(close[key].effect, key[0])
        elif seen[key]:
            verdict = limits.REJECTED
            reason = "the log is no more likely with it, or the effects found leave nothing for it"
        else:
            verdict, reason = limits.NOT_IDENTIFIABLE, "this motion does not show it"
        yield Candidate(
            effect=key[0],
            place=f.place if f else key[1],
            identifiable=seen.get(key, True),
            verdict=verdict,
            reason=reason,
        )
