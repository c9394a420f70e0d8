"""Searches of actuators against the loop over designs that a user would write in NumPy."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pipeline as lw
from actuators.loading.parts import load_parts
from pipeline.choice.group import front, merged
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import Shelf, combinations
from pipeline.choice.search import Demanded, torque_rms
from pipeline.choice.track import Account
from tests.bench_timing import Call, ratio, spread, timed

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[1]
EXACT, ELEMENTS, COMBINED = 1_000_000, 100_000, 1_000_000_000
_FEW = 300  # designs, or blocks of a thousand sums, that the loop is timed with
_WALK = Mode("walk", 24.0, False, None, {}, "motor", True, "walking")


def choice_ratios() -> None:
    """Net energy and RMS of many designs, power sample by sample, and sums of three groups."""
    loads = loads_of(lw.load(ROOT / "urdf" / "hexapod.toml"), [_WALK], samples=101)
    joints = loads[0].series.joints
    demanded = Demanded.of("all", joints, loads)
    track, series = demanded.tracks[0], loads[0].series
    shelf = Shelf.of(load_parts())
    some = shelf.designs(combinations(shelf))
    many = _many(some, EXACT)
    fewer = many.taken(np.arange(ELEMENTS))
    account = Account()
    tau, w, a = series.torque, series.velocity, series.acceleration
    ratios, ohmic, switched = many.ratio, many.ohmic, many.switched

    def torque(i: int) -> Array:
        """Of the motors of one design, (N, J) [N*m]."""
        n, s = ratios[i], np.sign(w)
        out = tau / n + many.load[i] / n * np.abs(tau) * s + many.coulomb[i] * s
        return np.asarray(out + many.viscous[i] * n * w + many.inertia[i] * n * a)

    def one(i: int) -> tuple[float, Array]:
        """Net power [W], and RMS of every joint [N*m]."""
        t = torque(i)
        power = t * (ratios[i] * w) + ohmic[i] * t**2
        mean = np.trapezoid(power.sum(axis=1), series.time) / loads[0].duration
        square = np.trapezoid(t**2, series.time, axis=0) / loads[0].duration
        return float(mean), np.sqrt(square)

    def element(i: int) -> float:
        """Power of which nothing flows back [W]."""
        t = torque(i)
        power = t * (ratios[i] * w) + ohmic[i] * t**2 + switched[i] * np.abs(t)
        mean = np.trapezoid(np.maximum(power, 0.0), series.time, axis=0) / loads[0].duration
        return float((mean + many.idle[i]).sum())

    thirds = [Demanded.of(k, [j for j in joints if j.endswith(k)], loads) for k in "123"]
    thousand = some.taken(np.arange(round(COMBINED ** (1 / 3))) * (len(some) // 1000))

    def by_fronts() -> None:
        groups = [(one.power(thousand, account), thousand.mass) for one in thirds]
        merged([(p[own], m[own]) for p, m in groups for own in [front(p, m)]])

    def sums() -> None:
        p, m = many.ratio[:1000], many.mass[:1000]  # any numbers will do
        for i in range(_FEW):
            power, mass = p[0] + p[i] + p, m[0] + m[i] + m
            front(power, mass)

    calls: dict[str, Call] = {
        "net energy": lambda: demanded.net(many),
        "RMS of every joint": lambda: torque_rms(track, many),
        "its loop": lambda: [one(i) for i in range(_FEW)],
        "power": lambda: demanded.power(fewer, account),
        "loop of it": lambda: [element(i) for i in range(_FEW)],
        "fronts": by_fronts,
        "sums": sums,
    }
    took = timed(calls, turns=3)
    both = [x + y for x, y in zip(took["net energy"], took["RMS of every joint"], strict=True)]
    size = f"{len(joints)} joints x {series.time.size} samples"
    print(f"designs of {size}; loops timed with {_FEW} designs and scaled up")
    for name, own, loop, scale in (
        (f"{EXACT:.0e} net energy and RMS", both, "its loop", EXACT / _FEW),
        (f"{ELEMENTS:.0e} sample by sample", took["power"], "loop of it", ELEMENTS / _FEW),
        (f"{COMBINED:.0e} robots by fronts", took["fronts"], "sums", 1e6 / _FEW),
    ):
        each = [scale * s for s in took[loop]]
        times = spread(ratio(each, own), 0)
        print(f"  {name:26s} {spread(own, 2)} s; the loop takes {times} times as long")


def _many(some: Designs, count: int) -> Designs:
    """Real designs again and again, each time with ratios a little higher."""
    which = np.arange(count) % len(some)
    arrays = {f.name: getattr(some, f.name)[which] for f in fields(some)[1:]}
    out = Designs((("", "", ""),) * count, **arrays)
    return replace(out, ratio=out.ratio * (1.0 + 0.001 * (np.arange(count) // len(some))))
