"""What can go wrong while calibrating."""

from __future__ import annotations

from pipeline.errors import PipelineError


class CalibrationError(PipelineError):
    """Root of the calibration's errors."""


class TargetError(CalibrationError):
    """The file of published values is incomplete, doubled or does not fit."""


class PriorError(CalibrationError):
    """The file of prior knowledge contradicts itself or the model."""
