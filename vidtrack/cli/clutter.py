"""The option --weibull: how the amplitudes of clutter are distributed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from vidtrack.detection.amplitude import Weibull


class _Clutter(click.ParamType):
    """B,C as a Weibull distribution."""

    name = "B,C"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Weibull:
        from vidtrack.detection.amplitude import Weibull

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
