"""What can go wrong in the gap room, each named for the fact."""

from __future__ import annotations


class GapError(Exception):
    """Root of every error the gap room raises; its message is one line: place and remedy."""


class LogFormatError(GapError):
    """The file is no log: unreadable bytes, ragged rows, decimal commas, unknown units."""


class LogContentError(GapError):
    """The log reads well and cannot be used: time runs backwards, a sensor is dead, too short."""


class WrongRobotError(GapError):
    """The log's joints are not those of the robot."""


class MappingError(GapError):
    """The mapping file is malformed, names an unknown unit or a column the log does not have."""


class PreparationError(GapError):
    """The log cannot be brought to one bandwidth, or not cut into separate parts."""


class ModelError(GapError):
    """A model without the joint or link that is asked for, or a file that is no robot."""


class ModelFileError(GapError):
    """The model file is malformed, names unknown effects, or its sources have changed."""


class EffectError(GapError):
    """An effect that is unknown, or parameters it does not have."""


class NamingError(GapError):
    """Nothing is left to compare: no usable row in a part of the data."""
