"""What can go wrong in the twin."""

from __future__ import annotations

from pipeline.errors import PipelineError


class TwinError(PipelineError):
    """The twin was asked for something it cannot simulate, or its simulation ran away."""
