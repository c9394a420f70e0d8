"""What can go wrong in the reports room, each named for the fact."""

from __future__ import annotations


class ReportError(Exception):
    """Root of every error the reports room raises; its message is one line."""


class TableError(ReportError):
    """A table whose columns, lengths or meanings do not fit together."""


class OutputError(ReportError):
    """A file that cannot be written where it was asked for."""


class FigureError(ReportError):
    """Data that do not fit the figure they were given to."""
