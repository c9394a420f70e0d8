"""What can go wrong in the pipeline room, each named for the fact."""

from __future__ import annotations


class PipelineError(Exception):
    """Root of every error the pipeline room raises; its message is one line."""


class RobotFileError(PipelineError):
    """The robot file is missing, malformed or contradicts itself."""


class UrdfError(PipelineError):
    """The URDF cannot be read or lacks what the robot file names."""


class UnphysicalModelError(PipelineError):
    """The model has an inertia, mass or geometry that no body can have."""


class GaitError(PipelineError):
    """The gait's numbers contradict each other or cannot be walked."""


class OutOfReachError(PipelineError):
    """A foot target lies outside what the leg reaches."""


class StanceError(PipelineError):
    """No forces of the ground carry the robot: a finding, not unusable input."""


class TippingError(StanceError):
    """A foot would have to pull on the ground: the robot tips."""


class SlidingError(StanceError):
    """The feet would have to hold more than friction does: the robot slides."""


class InvalidMotionError(PipelineError):
    """A motion holds no samples, or values that are not finite."""


class ReportError(Exception):
    """Root of every error the reports room raises; its message is one line."""


class TableError(ReportError):
    """A table whose columns, lengths or meanings do not fit together."""


class OutputError(ReportError):
    """A file that cannot be written where it was asked for."""


class FigureError(ReportError):
    """Data that do not fit the figure they were given to."""
