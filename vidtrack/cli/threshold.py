"""`vidtrack threshold`: where to set a radar's detection threshold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import common, start_log
from vidtrack.cli.radar_problem import problem_options

if TYPE_CHECKING:
    from vidtrack.detection.amplitude import Weibull

Numbers = dict[str, float | bool | None]

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


@click.command(
    name="threshold",
    short_help="The detection threshold that suits a tracker best.",
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
def command(
    kind: str,
    snr_db: float,
    q: float,
    gate: float,
    cell: float,
    weibull: Weibull | None,
    cells: float | None,
    pfa_max: float,
    output: Path | None,
    force: bool,
    quiet: bool,
    verbose: int,
    json_to: str | None,
) -> None:
    """The P_FA that lets a filter learn most of a Swerling I target.

    pda: P_FA that maximises the information reduction factor q2 for --cells resolution cells in the gate, in closed
    form (p_fa) and exactly (p_fa_exact), for Rayleigh clutter and a gate of 4; --q, --cell and --weibull play no
    part. Where the closed form does not hold (SNR of 1.96 dB or less) or gives --pfa-max or more, p_fa is
    --pfa-max and clamped is true. psn: P_FA that minimises the predicted steady-state error of a probabilistic
    strongest neighbour filter.
    """
    from vidtrack.cli.radar_problem import db_to_linear
    from vidtrack.detection.amplitude import RAYLEIGH
    from vidtrack.errors import ConfigError
    from vidtrack.output.folder import open_folder
    from vidtrack.radar.prediction import normalised
    from vidtrack.radar.psn_threshold import best_psn_threshold

    start_log(verbose, quiet)
    folder = None if output is None else open_folder(output, "threshold", force)
    snr = db_to_linear(snr_db)
    if not 0 < pfa_max <= 1:
        raise ConfigError(f"--pfa-max is {pfa_max}; it must lie above 0 and up to 1")
    numbers: Numbers
    if kind == "pda":
        numbers = _of_pda(snr, cells, pfa_max, gate, weibull)
    else:
        best = best_psn_threshold(normalised(q, gate, cell), snr, weibull or RAYLEIGH, pfa_max)
        numbers = {
            "p_fa": best.p_fa,
            "p_fa_one_percent": best.p_fa_one_percent,
            "p_d": best.p_d,
            "error": best.error,
            "clamped": True,
        }
    if deliver(numbers, json_to, folder and folder / "threshold.json", quiet):
        _print_table(numbers, f"{kind} filter at {snr_db:g} dB")


def _of_pda(snr: float, cells: float | None, pfa_max: float, gate: float, weibull: Weibull | None) -> Numbers:
    from vidtrack.detection.amplitude import detection_probability
    from vidtrack.detection.reduction import KE_GATE, q2
    from vidtrack.detection.threshold import closed_form, optimum
    from vidtrack.errors import ConfigError

    if cells is None or not LEAST_CELLS <= cells <= MOST_CELLS:
        raise ConfigError(
            f"--cells is {cells}; give the number of resolution cells in the gate, {LEAST_CELLS:g}..{MOST_CELLS:g}"
        )
    if gate != KE_GATE or weibull is not None:
        raise ConfigError("the threshold of pda holds for a gate of 4 and Rayleigh clutter; leave --gate and --weibull")
    p_fa, clamped = closed_form(snr, cells, pfa_max)
    p_d = detection_probability(p_fa, snr)
    return {
        "p_fa": float(p_fa),
        "p_fa_exact": float(optimum(snr, cells, pfa_max)),
        "p_d": float(p_d),
        "q2": float(q2(p_d, cells * p_fa)),
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
