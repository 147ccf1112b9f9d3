"""Options that define a radar problem: the target, its noise and gate, and the distribution of clutter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

from vidtrack.cli.options import Options
from vidtrack.errors import ConfigError

if TYPE_CHECKING:
    from vidtrack.amplitude.densities import Weibull

Function = TypeVar("Function", bound=Callable[..., Any])


class _Clutter(click.ParamType):
    """B,C as a Weibull distribution."""

    name = "B,C"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Weibull:
        from vidtrack.amplitude.densities import Weibull

        try:
            shape, rate = map(float, str(value).split(","))
        except ValueError:
            self.fail(f"{value!r} is not two numbers B,C such as 1.5,0.693", param, ctx)
        return Weibull(shape, rate)


weibull_option = click.option(
    "--weibull",
    type=_Clutter(),
    help="Radar: clutter amplitudes with P(a > t) = exp(-C t^B); 2,0.5 is receiver noise.",
)


@dataclass(frozen=True, kw_only=True)
class ProblemOptions(Options):
    """See `problem_options`."""

    snr_db: float
    q: float
    gate: float
    cell: float
    weibull: Weibull | None

    def snr(self) -> float:
        """The linear SNR. Raises ConfigError if it is not a number or is too high."""
        from math import isfinite

        from vidtrack.amplitude.densities import linear

        if not (isfinite(self.snr_db) and self.snr_db <= 100):
            raise ConfigError(f"--snr-db is {self.snr_db:g}; it must be a number of at most 100")
        return linear(self.snr_db)


def problem_options(function: Function) -> Function:
    """--q, --gate, --cell, --weibull, common to both radar commands."""
    for option in (
        weibull_option,
        click.option("--cell", default=0.1, show_default=True, help="Volume of a resolution cell, units of r."),
        click.option("--gate", default=4.0, show_default=True, help="Gate size in standard deviations."),
        click.option("--q", default=0.16, show_default=True, help="Variance of the acceleration, units of r / T^4."),
        click.option("--snr-db", type=float, required=True, metavar="DB", help="Signal-to-noise ratio of the target."),
    ):
        function = option(function)
    return function
