"""What can go wrong in choosing."""

from __future__ import annotations

from pipeline.errors import PipelineError


class MissionError(PipelineError):
    """A mission cannot be read, or a mode of it cannot be done."""


class ChoiceError(PipelineError):
    """Options contradict each other, or no design is within limits."""
