"""Identification of machines with a fixed base from joint torques, by regression."""

from pipeline.regression.identify import identify
from pipeline.regression.options import Options
from pipeline.regression.preprocess import Rows, Run, low_pass, rows
from pipeline.regression.result import Friction, Level, Result, Term
from pipeline.regression.statistics.bandwidth import prepare

__all__ = [
    "Friction",
    "Level",
    "Options",
    "Result",
    "Rows",
    "Run",
    "Term",
    "identify",
    "low_pass",
    "prepare",
    "rows",
]
