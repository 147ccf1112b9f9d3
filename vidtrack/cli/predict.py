"""`vidtrack predict`: the expected error of a radar track in clutter."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import common, receives, seed_option, start_log
from vidtrack.cli.radar_problem import ProblemOptions, problem_options

if TYPE_CHECKING:
    from vidtrack.radar.performance.forecast import Forecast, Trial

NAMES = {
    "paper": "eq. (33) of the paper, a lower bound",
    "corrected": "corrected HYCA",
    "kershaw_evans": "q2 by Kershaw and Evans' fit",
    "exact": "exact q2",
    "actual_all": "simulated, all runs",
    "actual_kept": "simulated, runs that never strayed",
}


@dataclass(frozen=True, kw_only=True)
class PredictOptions(ProblemOptions):
    """Options of `vidtrack predict`."""

    kind: Literal["psn", "pda"]
    pfa: float
    scans: int
    runs: int | None
    seed: int
    json_to: str | None


@click.command(
    name="predict",
    epilog="""\b
Examples:
  vidtrack predict --filter psn --snr-db 16 --pfa 1e-1
  vidtrack predict --filter pda --snr-db 10 --pfa 1e-2 --q 0.01 --cell 4 --scans 35 --json -
  vidtrack predict --filter psn --snr-db 16 --pfa 1e-3 --weibull 1.5,0.693 --runs 1000 -o sea""",
)
@click.option("--filter", "kind", type=click.Choice(["psn", "pda"]), default="psn", show_default=True)
@problem_options
@click.option("--pfa", type=float, required=True, metavar="P", help="Probability of false alarm in a cell.")
@click.option("--scans", type=click.IntRange(min=1), default=50, show_default=True)
@click.option(
    "--runs", type=click.IntRange(min=1), metavar="N", help="Simulate N runs as well: the share of lost tracks."
)
@common("Folder for prediction.png.  [default: no picture]")
@seed_option
@json_option
@receives(PredictOptions)
def command(options: PredictOptions) -> None:
    """Expected position error after each scan, sqrt(P11 + P33), in units of sqrt(r).

    A Swerling I target with nearly constant velocity in the plane, T = 1, begun by two points. psn: probabilistic
    strongest neighbour filter, by eq. (33) of paper 002 as printed and by its corrected form. pda: probabilistic
    data association filter, by the Kershaw-Evans fit (gate 4 only) and by the exact information reduction factor.

    With --runs a track counts as lost if its last error is above 20 (pda: 10), or the target was outside the gate
    in each of the last five scans.
    """
    from vidtrack.amplitude.densities import RAYLEIGH
    from vidtrack.radar.performance.forecast import first_trial, forecast, trial
    from vidtrack.rehearsal import rehearse_beside

    start_log(options.verbose, options.quiet)
    folder = options.folder("predict")
    kind, pfa, clutter = options.kind, options.pfa, options.weibull or RAYLEIGH
    if options.runs is not None:
        rehearse_beside(first_trial, kind)
    expected = forecast(kind, options.snr(), pfa, clutter, options.q, options.gate, options.cell, options.scans)
    tried = None if options.runs is None else trial(expected, options.runs, options.seed)
    if folder is not None:
        _plot(expected, tried, folder / "prediction.png")
    if deliver(_content(expected, tried), options.json_to, None, options.quiet):
        title = f"{kind} filter at {options.snr_db:g} dB, P_FA {pfa:g}, P_D {expected.law.p_d:.4f}"
        _print_table(expected, tried, title)


def _content(expected: Forecast, tried: Trial | None) -> dict[str, Any]:
    content: dict[str, Any] = {"k": expected.scan.tolist()}
    content |= {name: None if error is None else error.tolist() for name, error in expected.error.items()}
    if tried is not None:
        content |= {
            "runs": tried.runs,
            "loss_share": tried.loss_share,
            "loss_share_se": tried.loss_share_se,
            "strayed_share": tried.strayed_share,
            "actual_all": tried.actual_all.tolist(),
            "actual_kept": None if tried.actual_kept is None else tried.actual_kept.tolist(),
        }
    return content


def _columns(expected: Forecast, tried: Trial | None) -> dict[str, Any]:
    """Name and values of each curve."""
    columns = {name: error for name, error in expected.error.items() if error is not None}
    if tried is not None:
        columns["actual_all"] = tried.actual_all
        if tried.actual_kept is not None:
            columns["actual_kept"] = tried.actual_kept
    return columns


def _print_table(expected: Forecast, tried: Trial | None, title: str) -> None:
    from rich.console import Console
    from rich.table import Table

    columns = _columns(expected, tried)
    table = Table("k", *columns, title=title, caption=_caption(expected, tried), caption_justify="left", min_width=72)
    for column in table.columns:
        column.justify = "right"
    for i, k in enumerate(expected.scan):
        table.add_row(str(k), *(f"{error[i]:.4f}" for error in columns.values()))
    Console().print(table)


def _caption(expected: Forecast, tried: Trial | None) -> str:
    lines = []
    for name, error in expected.error.items():
        settled = expected.steady[name]
        if error is None:
            lines.append(f"{name}: the fit holds for a gate of 4 only")
        elif settled is None:
            lines.append(f"{name}: no steady state, the error grows without bound")
        else:
            lines.append(f"{name}: steady state {settled:.4f}")
    if tried is not None:
        lines.append(
            f"{tried.runs} runs: {tried.loss_share:.2%} lost (standard error {tried.loss_share_se:.2%}), "
            f"{tried.strayed_share:.2%} above the limit of {tried.limit:g} at some scan; actual_kept leaves these out"
        )
    return "\n".join(lines)


def _plot(expected: Forecast, tried: Trial | None, path: Path) -> None:
    from vidtrack.output.folder import writing
    from vidtrack.papers import style

    drawing, (ax,) = style.figure(panel=(6.4, 4.0))
    columns = _columns(expected, tried)
    for (name, error), colour in zip(columns.items(), style.CYCLE, strict=False):
        ax.plot(expected.scan, error, "." if name.startswith("actual") else "-", color=colour, label=NAMES[name])
    ax.set_xlabel("scan k")
    ax.set_ylabel("position error, units of sqrt(r)")
    ax.set_ylim(0, 1.5 * max(error.max() for name, error in columns.items() if name != "actual_all"))
    style.legend(ax)
    with writing(path):
        drawing.savefig(path)
