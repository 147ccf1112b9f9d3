"""Errors that the user can correct. Each message contains the fault, the value and the remedy."""

from __future__ import annotations


class Error(Exception):
    """Base of all errors that vidtrack raises; `exit_code` is that of the command."""

    exit_code = 2


class ConfigError(Error):
    """A setting is unknown, of the wrong type or out of range."""


class OutputError(Error):
    """Results cannot be written to the given place."""


class StoppedEarly(Error):  # noqa: N818
    """A run had to stop, for example on a full disk; what was written before stays valid."""

    exit_code = 1


class SourceError(Error):
    """The input is missing, empty or not a video, or yields no frame."""

    exit_code = 3


class ScanError(Error, ValueError):
    """A scan or a track state is malformed: wrong shape, NaN, or not a covariance."""


class FormatError(Error):
    """A table (MOT, CSV, Parquet) cannot be read; the message names the line."""

    exit_code = 3


class PlotFormatError(FormatError):
    """A table of radar plots cannot be used; the message names the column, or the lines and their faults."""
