"""`vidtrack threshold`: the best detection threshold of a radar."""

from __future__ import annotations

from dataclasses import dataclass

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import common, receives, start_log
from vidtrack.cli.radar_problem import ProblemOptions, problem_options

Numbers = dict[str, float | bool | None]

_UNUSED = {"pda": ("q", "cell", "weibull"), "psn": ("cells",)}
"""Options without effect on the threshold of a filter."""
LEAST_CELLS, MOST_CELLS = 1e-3, 1e12

MEANING = {
    "p_fa": "probability of false alarm to set",
    "p_fa_exact": "the same by the optimum of the exact q2",
    "p_fa_one_percent": "smallest one whose error is within 1 % of the best",
    "p_d": "probability of detection at p_fa",
    "q2": "exact information reduction factor at p_fa",
    "error": "predicted steady-state position error, units of sqrt(r); none: it grows without bound",
    "clamped": "whether p_fa is the largest allowed",
}


@dataclass(frozen=True, kw_only=True)
class ThresholdOptions(ProblemOptions):
    """Options of `vidtrack threshold`."""

    kind: str
    cells: float | None
    pfa_max: float
    json_to: str | None


@click.command(
    name="threshold",
    epilog="""\b
Examples:
  vidtrack threshold --snr-db 10 --cells 100
  vidtrack threshold --snr-db 13 --cells 30 --pfa-max 0.1 --json -
  vidtrack threshold --filter psn --snr-db 16 --cell 0.1 --q 0.16""",
)
@click.option("--filter", "kind", type=click.Choice(["pda", "psn"]), default="pda", show_default=True)
@problem_options
@common("Folder for threshold.json.  [default: only printed]")
@click.option("--cells", type=float, metavar="N", help="Resolution cells in the gate (pda).")
@click.option("--pfa-max", default=1.0, show_default=True, help="Largest P_FA allowed.")
@json_option
@receives(ThresholdOptions)
def command(options: ThresholdOptions) -> None:
    """The P_FA that lets a filter learn most of a Swerling I target.

    pda: P_FA that maximises the information reduction factor q2 for --cells resolution cells in the gate, in closed
    form (p_fa) and exactly (p_fa_exact), for Rayleigh clutter; --q, --cell and --weibull are refused. The closed form
    is for a --gate of 4; with another gate only the exact optimum is given. Where the closed form does not hold (SNR
    of 1.96 dB or less) or gives --pfa-max or more, p_fa is --pfa-max and clamped is true. psn: P_FA that minimises
    the predicted steady-state error of a probabilistic strongest neighbour filter; --cells is refused.
    """
    from vidtrack.errors import ConfigError

    start_log(options.verbose, options.quiet)
    _refuse_unused(options.kind)
    folder = options.folder("threshold")
    snr = options.snr()
    if not 0 < options.pfa_max <= 1:
        raise ConfigError(f"--pfa-max is {options.pfa_max}; it must lie above 0 and up to 1")
    numbers = _of_pda(options, snr) if options.kind == "pda" else _of_psn(options, snr)
    if deliver(numbers, options.json_to, folder and folder / "threshold.json", options.quiet):
        _print_table(numbers, f"{options.kind} filter at {options.snr_db:g} dB")


def _refuse_unused(kind: str) -> None:
    """Raise UsageError for options on the command line that have no effect with this filter."""
    context = click.get_current_context()
    for name in _UNUSED[kind]:
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(f"--{name} has no effect with --filter {kind}; leave it out")


def _of_psn(options: ThresholdOptions, snr: float) -> Numbers:
    from vidtrack.amplitude.densities import RAYLEIGH
    from vidtrack.radar.performance.prediction import normalised
    from vidtrack.radar.performance.psn_threshold import best_psn_threshold

    problem = normalised(options.q, options.gate, options.cell)
    best = best_psn_threshold(problem, snr, options.weibull or RAYLEIGH, options.pfa_max)
    return {
        "p_fa": best.p_fa,
        "p_fa_one_percent": best.p_fa_one_percent,
        "p_d": best.p_d,
        "error": best.error,
        "clamped": True,
    }


def _of_pda(options: ThresholdOptions, snr: float) -> Numbers:
    from vidtrack.amplitude.densities import detection_probability
    from vidtrack.amplitude.reduction import KE_GATE, LEAST_GATE, MOST_GATE, q2
    from vidtrack.amplitude.threshold import closed_form, optimum
    from vidtrack.errors import ConfigError

    cells = options.cells
    if cells is None or not LEAST_CELLS <= cells <= MOST_CELLS:
        raise ConfigError(
            f"--cells is {cells}; give the number of resolution cells in the gate, {LEAST_CELLS:g}..{MOST_CELLS:g}"
        )
    if not LEAST_GATE <= options.gate <= MOST_GATE:
        raise ConfigError(f"gate is {options.gate:g}; it must lie in {LEAST_GATE:g}..{MOST_GATE:g}")
    exact = float(optimum(snr, cells, options.pfa_max, gate=options.gate))
    fitted = options.gate == KE_GATE
    p_fa, clamped = closed_form(snr, cells, options.pfa_max) if fitted else (exact, exact >= options.pfa_max)
    p_d = detection_probability(p_fa, snr)
    return {
        **({"p_fa": float(p_fa)} if fitted else {}),
        "p_fa_exact": exact,
        "p_d": float(p_d),
        "q2": float(q2(p_d, cells * p_fa, gate=options.gate)),
        "clamped": bool(clamped),
    }


def _print_table(numbers: Numbers, title: str) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("", "value", "meaning", title=title)
    table.columns[1].justify = "right"
    for name, value in numbers.items():
        table.add_row(name, f"{value:.6g}" if isinstance(value, float) else str(value).lower(), MEANING[name])
    Console().print(table)
