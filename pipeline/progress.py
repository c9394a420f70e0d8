"""How far a run is and how long it still takes, on a terminal only."""

from __future__ import annotations

import logging
import shutil
import sys
from threading import Event, Lock, Thread
from time import perf_counter
from types import TracebackType
from typing import Any, Final

logger = logging.getLogger("legwatt")
#: Share of a run's time that has usually passed when a step begins, by verb: of the shipped robots
#: and logs.
_BEGUN: Final[dict[str, dict[str, float]]] = {
    "stand": {"loading": 0.0, "standing": 0.8, "writing tables": 0.9},
    "walk": {"loading": 0.0, "walking": 0.6, "tables of walking": 0.7, "writing tables": 0.8},
    "reports": {
        "loading": 0.0,
        "standing": 0.1,
        "walking": 0.11,
        "tables of walking": 0.13,
        "comparing with the paper": 0.15,
        "writing tables": 0.17,
        "drawing figures": 0.2,
    },
    "gap": {
        "loading": 0.0,
        "reading foreign files": 0.05,
        "reading and judging the logs": 0.1,
        "simulating the logs' motion": 0.2,
        "adding up the drives": 0.3,
        "driving the model by its servos": 0.3,
        "weighing the model file's effects": 0.3,
        "letting a few effects compete": 0.3,
        "letting effects compete": 0.3,
        "fitting the whole machine": 0.4,
        "weighing what was found": 0.8,
        "writing": 0.9,
    },
}
_SECONDS: Final = 0.5  # between two looks at the clock


class Progress:
    """Steps of a run as a bar with the time that is left, roughly.

    Within a step the bar moves at the speed of the run so far, up to where the next step begins.
    It is shown where standard error is a terminal, once it is entered; with ``-v`` the messages of
    the log tell the steps instead. Without being entered it only takes their times.

    Attributes:
        seconds: What every step took so far, by its text [s].
    """

    def __init__(self, verb: str = "") -> None:
        """Prepare; nothing is shown.

        Args:
            verb: Whose steps these are.
        """
        self.seconds: dict[str, float] = {}
        self._begun = _BEGUN.get(verb, {})
        self._running = ""
        self._start = self._since = self._looked = perf_counter()
        self._share, self._first, self._next = 0.0, 0.0, 1.0
        self._bar: Any = None
        self._ended, self._lock = Event(), Lock()

    def __enter__(self) -> Progress:
        loud = logger.isEnabledFor(logging.INFO)
        if self._bar is None and sys.stderr.isatty() and not loud:
            from tqdm import tqdm

            form = "{desc:<36}|{bar}| {elapsed}, about {remaining} left"
            size = shutil.get_terminal_size()  # 80 by 24 where the terminal does not say
            self._bar = tqdm(
                total=1.0,
                bar_format=form,
                leave=False,
                smoothing=0.0,
                ncols=size.columns - 1,
                nrows=size.lines,
            )
            Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Take the bar off the terminal, so that lines can be printed."""
        self._stop()
        self._ended.set()
        with self._lock:
            if self._bar is not None:
                self._bar.close()

    def took(self) -> str:
        """Every step and its seconds, the longest first, in words."""
        longest = sorted(self.seconds.items(), key=lambda item: -item[1])
        return ", ".join(f"{text} {seconds:.1f} s" for text, seconds in longest)

    def step(self, text: str) -> None:
        """Say what comes next."""
        self._stop()
        now = perf_counter()
        with self._lock:
            self._running, self._since = text, now
            begun = self._begun.get(text, self._share)
            self._first = self._share = max(self._share, begun)
            self._next = min((s for s in self._begun.values() if s > self._share), default=1.0)
            self._looked = now
            if self._bar is not None:
                self._bar.set_description_str(text, refresh=False)
        self._show()

    def done(self, share: float) -> None:
        """Say how much of the running step is done.

        Args:
            share: From 0 to 1.
        """
        with self._lock:
            self._share = max(self._share, self._first + share * (self._next - self._first))
            self._looked = perf_counter()
        self._show()

    def _stop(self) -> None:
        if self._running:
            past = perf_counter() - self._since
            self.seconds[self._running] = self.seconds.get(self._running, 0.0) + past
            logger.info("%s took %.1f s", self._running, past)
        self._running = ""

    def _watch(self) -> None:
        while not self._ended.wait(_SECONDS):
            self._show()

    def _show(self) -> None:
        with self._lock:
            if self._bar is None or self._ended.is_set():
                return
            now, known = perf_counter(), self._looked - self._start
            speed = self._share / known if known > 0 else 0.0  # [1/s]
            self._bar.n = min(self._share + speed * (now - self._looked), 0.99 * self._next)
            self._bar.refresh()
