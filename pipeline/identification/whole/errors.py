"""Why a machine cannot be fitted as a whole."""

from pipeline.logs.errors import GapError


class NotWholeError(GapError):
    """The machine or its log does not allow it; other steps go on, and the reason is told."""
