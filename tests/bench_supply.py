"""Sweeps and the supply's laws against the loop that a user would write."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from actuators.elements.heating import COPPER
from actuators.elements.two_body import REFERENCE_K, TwoBody
from actuators.supply import Battery
from pipeline.sweep.case import Order, machine_of
from pipeline.sweep.sweep import sweep
from tests.bench_timing import Call, ratio, spread, timed

SPEEDS = [0.02 + 0.02 * k for k in range(8)]  # [m/s]


def sweep_ratio() -> None:
    """A sweep against the same walks without rows, parts and file."""
    order = Order(samples=51)
    machine = machine_of(order)

    def bare() -> None:
        for speed in SPEEDS:
            given = order.walking(machine.with_values({"gait.speed": f"{speed!r} m/s"}))
            given.walk(given.chains())

    def swept() -> None:
        with tempfile.TemporaryDirectory() as folder:
            sweep(order, ["speed=" + ",".join(map(repr, SPEEDS)) + " m/s"], Path(folder))

    seconds = timed({"bare": bare, "sweep": swept}, turns=5)
    each = [1e3 * s / len(SPEEDS) for s in seconds["sweep"]]
    print(f"sweep of {len(SPEEDS)} speeds of the hexapod, 51 samples, four alternatives")
    print(
        f"  {spread(each)} ms a case, {spread(ratio(seconds['sweep'], seconds['bare']))} of walks"
    )


def supply_ratios() -> None:
    """Battery life and heat of many candidates against one after the other."""
    rng = np.random.default_rng(1)
    pack = Battery("pack", 2.3e6, 54.6, 39.0, 0.15)
    power, shares = rng.uniform(5.0, 300.0, (100_000, 5)), np.full(5, 0.2)
    body, seconds = TwoBody(1.93, 4.65, 42.8, 809.0), np.array([600.0, 60.0, 1800.0])
    copper = rng.uniform(0.0, 15.0, (100_000, 3))
    few = 20

    def discharge(row: np.ndarray) -> float:
        """By a general integrator."""

        def rate(_: float, s: np.ndarray) -> list[float]:
            return [-(pack.current(row, np.full(5, s[0])) @ shares) / pack.charge]

        def empty(_: float, s: np.ndarray) -> float:
            return float(s[0])

        empty.terminal = True  # type: ignore[attr-defined]
        return float(solve_ivp(rate, (0, 1e7), [1.0], events=empty, rtol=1e-6).t[-1])

    def round_of(row: np.ndarray) -> np.ndarray:
        """Ten rounds by a general integrator."""
        winding, housing = 42.8 / 1.93, 809.0 / 4.65
        state = np.full(2, REFERENCE_K)

        def slope(_: float, x: np.ndarray, loss: float) -> list[float]:
            through = (x[0] - x[1]) / 1.93
            warm = loss * (1 + COPPER * (x[0] - REFERENCE_K))
            out = (x[1] - REFERENCE_K) / 4.65
            return [(warm - through) / winding, (through - out) / housing]

        for _ in range(10):
            for time, loss in zip(seconds, row, strict=True):
                state = solve_ivp(slope, (0, time), state, args=(loss,), rtol=1e-6).y[:, -1]
        return state

    calls: dict[str, Call] = {
        "battery life": lambda: pack.hours(power, shares),
        "its loop": lambda: [discharge(row) for row in power[:few]],
        "winding over a day": lambda: body.day(seconds, copper),
        "its loop too": lambda: [round_of(row) for row in copper[:few]],
    }
    took = timed(calls, turns=3)
    print("supply of 100 000 candidates at once, and a loop with SciPy's integrator")
    for fast, slow in (("battery life", "its loop"), ("winding over a day", "its loop too")):
        own = took[fast]
        each = [s * len(power) / few for s in took[slow]]
        print(f"  {fast:18s} {spread(own)} s; the loop takes {spread(ratio(each, own), 0)} times")
