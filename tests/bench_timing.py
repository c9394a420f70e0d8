"""CPU time of calls that take turns, and ratios of it."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping

TURNS = 15

Call = Callable[[], object]


def timed(calls: Mapping[str, Call], turns: int = TURNS) -> dict[str, list[float]]:
    """CPU seconds of each call, taking turns; one turn to warm up is not counted."""
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(turns + 1):
        for name, call in calls.items():
            start = time.process_time()
            call()
            if turn:
                seconds[name].append(time.process_time() - start)
    return seconds


def spread(values: list[float], digits: int = 2) -> str:
    """Median with range."""
    low, high = min(values), max(values)
    return f"{statistics.median(values):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def ratio(over: list[float], under: list[float]) -> list[float]:
    """Turn by turn."""
    return [a / b for a, b in zip(over, under, strict=True)]
