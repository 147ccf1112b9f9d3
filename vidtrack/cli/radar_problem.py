"""Options with which `predict` and `threshold` state their problem."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from vidtrack.cli.clutter import weibull_option
from vidtrack.errors import ConfigError

Function = TypeVar("Function", bound=Callable[..., Any])


def problem_options(function: Function) -> Function:
    """--q, --gate, --cell, --weibull: what both radar commands ask about the target and its surroundings."""
    for option in (
        weibull_option,
        click.option("--cell", default=0.1, show_default=True, help="Volume of a resolution cell, units of r."),
        click.option("--gate", default=4.0, show_default=True, help="Gate size in standard deviations."),
        click.option("--q", default=0.16, show_default=True, help="Variance of the acceleration, units of r / T^4."),
        click.option("--snr-db", type=float, required=True, metavar="DB", help="Signal-to-noise ratio of the target."),
    ):
        function = option(function)
    return function


def db_to_linear(db: float) -> float:
    """A linear SNR. Raises ConfigError for one that is no number, or too high to mean anything."""
    from math import isfinite

    from vidtrack.detection.amplitude import linear

    if not (isfinite(db) and db <= 100):
        raise ConfigError(f"--snr-db is {db:g}; it must be a number of at most 100")
    return linear(db)
