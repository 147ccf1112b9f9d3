"""`vidtrack eval`: all scores of a result in one report."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vidtrack.cli.json_file import deliver, json_option
from vidtrack.cli.options import Options, common, receives, start_log

if TYPE_CHECKING:
    from vidtrack.formats import Table

log = logging.getLogger(__name__)

_SURELY = 10
"""So many frames with rows tell the step between them."""

SECTIONS = {
    "counts": {
        "frames": "frames with an object",
        "truth_tracks": "objects in the truth",
        "truth_rows": "their rows",
        "tracks": "tracks in the result",
        "rows": "their rows",
    },
    "CLEAR": {
        "mota": "1 - misses, false, switches by truth rows",
        "motp": "mean similarity of the matches",
        "matches": "rows matched",
        "misses": "truth rows without a match",
        "false_positives": "result rows without a match",
        "switches": "an object goes on in another track",
        "fragmentations": "an object is found again after a gap",
        "mostly_tracked": "objects found in over 80 % of rows",
        "partially_tracked": "objects between the two",
        "mostly_lost": "objects found in under 20 % of rows",
    },
    "identity": {
        "idf1": "rows in each object's one best track",
        "idp": "... share of the result's rows",
        "idr": "... share of the truth's rows",
    },
    "HOTA": {
        "hota": "detection and association in balance",
        "deta": "detection accuracy",
        "assa": "association accuracy",
    },
    "OSPA, GOSPA": {
        "cutoff": "cost of an object without partner",
        "order": "exponent of the means",
        "ospa": "mean distance of the two sets",
        "ospa_localisation": "its part from distances",
        "ospa_cardinality": "its part from a wrong number",
        "gospa": "summed distance of the two sets",
        "gospa_localisation": "its part from distances",
        "gospa_missed": "its part from missed objects",
        "gospa_false": "its part from false tracks",
    },
    "consistency": {
        "nis": "mean normalised innovation squared",
        "nis_low": "... lower 95 % bound; not of video, whose errors last",
        "nis_high": "... upper 95 % bound, likewise",
        "nis_inside": "share below the 95 % quantile",
        "nis_samples": "number of values",
        "nees": "mean normalised position error squared",
        "nees_low": "... lower 95 % bound",
        "nees_high": "... upper 95 % bound",
        "nees_inside": "share below the 95 % quantile",
        "nees_samples": "number of values",
    },
}


@dataclass(frozen=True, kw_only=True)
class EvalOptions(Options):
    """Options of `vidtrack eval`."""

    result: Path
    truth: Path
    json_to: str | None
    iou: float
    points: bool
    max_distance: float | None
    cutoff: float | None
    order: float
    every: int


@click.command(
    name="eval",
    epilog="""\b
Examples:
  vidtrack eval runs/junction samples/junction.txt --iou 0.3
  vidtrack eval mot.txt gt.txt --iou 0.3 --json scores.json
  vidtrack eval runs/ten-a-second gt.txt --every 3
  vidtrack eval tracks.csv truth.csv --points --max-distance 50 --json -""",
)
@click.argument("result", type=click.Path(path_type=Path))
@click.argument("truth", type=click.Path(path_type=Path))
@common("Folder for scores.json.  [default: only printed]")
@json_option
@click.option("--iou", default=0.5, show_default=True, help="Boxes match from this intersection over union.")
@click.option("--points", is_flag=True, help="Match positions instead of boxes.")
@click.option("--max-distance", type=float, help="Positions match up to this distance.  [default: 20 px or 100 m]")
@click.option("--cutoff", type=float, help="OSPA, GOSPA cutoff.  [default: 1 for boxes (1 - IoU), else --max-distance]")
@click.option("--order", default=2.0, show_default=True, help="OSPA, GOSPA order p.")
@click.option(
    "--every",
    default=1,
    show_default=True,
    type=click.IntRange(1),
    metavar="N",
    help="Score every Nth frame only, from the first on: those that a run with --max-fps has.",
)
@receives(EvalOptions)
def command(options: EvalOptions) -> None:
    """Score RESULT (MOT text, CSV, Parquet or a run folder) against TRUTH (MOT gt.txt or CSV).

    For a run folder of `vidtrack radar --radar-position`, TRUTH can be ADS-B (ASTERIX CAT 021), CAT 062 or AIS.
    Scores are fractions, not percent. Truth rows with conf 0 are ignored. Boxes are matched by
    intersection over union, positions (radar) by distance. Of a run folder mot.txt is scored, and
    the tracks table gives the consistency of the covariances (NIS, NEES).
    """
    from vidtrack import formats, score
    from vidtrack.radar.feeds.recording import is_feed
    from vidtrack.radar.feeds.truth import read_truth

    start_log(options.verbose, options.quiet)
    result, truth = options.result, options.truth
    folder = options.folder("eval")
    found = formats.read(result)
    states = formats.read_states(result) if result.is_dir() else None
    true = read_truth(truth, result) if is_feed(truth) else formats.read(truth)
    if options.every > 1:
        found, true = _of_frames(found, options.every), _of_frames(true, options.every)
        states = None if states is None else _of_frames(states, options.every)
    else:
        _tell_of_thinned(found, true)
    scores = score.evaluate(
        found,
        true,
        iou=options.iou,
        points=options.points,
        max_distance=options.max_distance,
        cutoff=options.cutoff,
        order=options.order,
        states=states,
    )
    if deliver(scores, options.json_to, folder and folder / "scores.json", options.quiet):
        _print_table(scores, f"{result.name} against {truth.name}")


def _of_frames(table: Table, every: int) -> Table:
    """The rows of frames 0, `every`, twice `every`, ..."""
    return table.select(table.frame % every == 0)


def _tell_of_thinned(result: Table, truth: Table) -> None:
    """Warn if the result has rows in every Nth frame only, and the truth in others."""
    import numpy as np

    frames = np.unique(result.frame)
    every = int(np.gcd.reduce(frames)) if len(frames) >= _SURELY else 1
    between = np.count_nonzero(truth.frame % every)
    if between > len(truth) / 4:
        log.warning(
            "the result has rows in one frame of %d only; the %d rows of the truth in others count as missed, "
            "and --every %d leaves them out", every, between, every,
        )  # fmt: skip


def _print_table(scores: dict[str, float | int | str], title: str) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("score", "value", "meaning", title=title, caption=f"matched by {scores['matched_by']}")
    table.columns[1].justify = "right"
    for section, names in SECTIONS.items():
        rows = [(name, scores[name], meaning) for name, meaning in names.items() if name in scores]
        if rows:
            table.add_row(f"[bold]{section}[/bold]")
        for name, value, meaning in rows:
            table.add_row(f"  {name}", f"{value:.4f}" if isinstance(value, float) else str(value), meaning)
        table.add_section()
    Console().print(table)
