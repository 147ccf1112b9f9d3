"""Score tracks of the CDnet highway sequence against the vehicle identities derived from its masks.

    python tools/score_highway.py RUN_OR_MOT

RUN_OR_MOT is a run over VIDTRACK_DATA/highway/input (image number = MOT frame) or a MOT file of one.
The truth covers frames 470-1085 and the near part of the picture only, so results far away are dropped
and results in the two border zones count only where they match.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from vidtrack import formats, score
from vidtrack.formats import Table
from vidtrack.score.clear import correspondences

FIRST, LAST = 470, 1085  # image numbers with truth
FAR_Y = 103.0  # px; results with their centre above are outside the truth
ENTRY_Y = 127.0  # px; above it the truth may not have begun
BOTTOM_Y = 237.0  # px; below it the truth may have ended


def judged(result: Table, truth: Table, iou: float) -> Table:
    """The rows of a result that count, by the rules of the data's manifest."""
    image = result.frame + 1
    result = result.select((image >= FIRST) & (image <= LAST) & (result.xy[:, 1] >= FAR_Y))
    matchup = score.match_boxes(result, truth)
    assert result.box is not None  # or it could not have been matched
    counts = (result.xy[:, 1] >= ENTRY_Y) & (result.box[:, 1] + result.box[:, 3] < BOTTOM_Y)
    counts[matchup.result[correspondences(matchup, iou)]] = True
    return result.select(counts)


def main() -> None:
    """Print the scores of a run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result", type=Path, help="run folder or MOT file")
    parser.add_argument("--iou", type=float, default=0.5, help="boxes match from this IoU (default 0.5)")
    options = parser.parse_args()
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds highway/")
    truth = formats.read(Path(os.environ["VIDTRACK_DATA"]) / "highway" / "gt_ids.txt")
    result = formats.read(options.result)
    if result.box is None:
        parser.error(f"{options.result} has no boxes; give a video run or a MOT file")
    scores = score.evaluate(judged(result, truth, options.iou), truth, iou=options.iou)
    for name in ("mota", "idf1", "switches", "misses", "false_positives", "fragmentations", "tracks"):
        value = scores[name]
        print(f"{name:16s} {value:.4f}" if isinstance(value, float) else f"{name:16s} {value}")


if __name__ == "__main__":
    main()
