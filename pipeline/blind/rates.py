"""Rates with their uncertainty: Wilson's interval for a share of independent trials."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rate:
    """How often something came out as it should, or should not.

    Attributes:
        name: Key, e.g. ``"right_name_and_place"``.
        meaning: In words.
        hits: How often.
        trials: Out of how many.
        aim: What is aimed at, e.g. ``(0.95, 1.0)``; None where nothing is.
    """

    name: str
    meaning: str
    hits: int
    trials: int
    aim: tuple[float, float] | None

    @property
    def value(self) -> float:
        """Share; NaN without trials."""
        return self.hits / self.trials if self.trials else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval."""
        return wilson(self.hits, self.trials)

    @property
    def reached(self) -> bool:
        """Whether the share lies inside the aim; where nothing is aimed at it does.

        An aim with two ends, as of the coverage of intervals, is missed above only beyond chance:
        6 of 6 are no sign that intervals are too wide.
        """
        if self.aim is None:
            return True
        low, high = self.aim
        most = self.interval[0] if low > 0.0 and high < 1.0 else self.value
        return bool(self.trials) and low <= self.value and most <= high

    def __str__(self) -> str:
        """Counts, share with its interval, aim and verdict in one line."""
        low, high = self.interval
        text = (
            f"{self.name} ({self.meaning}): {self.hits} of {self.trials} = {self.value:.1%}, "
            f"95 % interval of this share {low:.1%} to {high:.1%}"
        )
        if self.aim is None:
            return text
        verdict = "reached" if self.reached else "missed"
        if (
            not self.aim[0] <= self.value <= self.aim[1]
            and low <= self.aim[1]
            and high >= self.aim[0]
        ):
            verdict = (
                "above it by no more than chance, which is no miss"
                if self.reached
                else f"missed, though a share inside it is not excluded by {self.trials} trials"
            )
        return f"{text}; aim {self.aim[0]:.0%} to {self.aim[1]:.0%}: {verdict}"


def wilson(hits: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share, by Wilson's score; without trials it is all there is, (0, 1).

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of
    the American Statistical Association 22, 1927.

    Args:
        hits: How often.
        trials: Out of how many.
    """
    from scipy.stats import binomtest

    if trials <= 0:
        return 0.0, 1.0
    low, high = binomtest(hits, trials).proportion_ci(method="wilson")
    return float(low), float(high)
