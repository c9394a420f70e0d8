"""What can go wrong while calibrating."""

from __future__ import annotations

from pipeline.errors import PipelineError


class CalibrationError(PipelineError):
    """A file of printed values, prior or results cannot be used, or nothing meets the targets."""
