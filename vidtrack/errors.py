"""Errors a user can act on: each says what was wrong, with the offending value, and what to do."""

from __future__ import annotations


class Error(Exception):
    """Base of every error vidtrack raises on purpose; `exit_code` is what the command line returns."""

    exit_code = 2


class ConfigError(Error):
    """A setting is unknown, of the wrong type or out of range."""


class OutputError(Error):
    """Results cannot be written where they were asked for."""


class StoppedEarly(Error):  # noqa: N818
    """A run had to stop, for example on a full disk; what was written before stays valid."""

    exit_code = 1


class SourceError(Error):
    """The input is missing, empty, not a video, or yields nothing."""

    exit_code = 3


class ScanError(Error, ValueError):
    """A scan or a track state is malformed: wrong shape, NaN, or not a covariance."""


class FormatError(Error):
    """A table (MOT, CSV, Parquet) cannot be read; the message names the line."""

    exit_code = 3


class PlotFormatError(FormatError):
    """A table of radar plots cannot be used; the message names the column, or the lines and what is wrong in them."""
