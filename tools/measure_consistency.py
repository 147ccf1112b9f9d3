"""Whether the errors that runs over video state are true: NEES of the position by kind of row.

    python tools/measure_consistency.py --seeds 101-110
    python tools/measure_consistency.py road --size 640x360 --seconds 20 --seeds 1-3

The scene is one of `vidtrack simulate` with a video; `junction` by default.
A row is a row of tracks.parquet that a box of the truth matches (IoU from 0.3). NEES is e' P^-1 e, with e from the
middle of the true box, which ends at the border of the picture; its mean is 2 if P is right. `rms` is of both axes,
and `stated` what P says of it. Kinds by the true box: its area, and how much of it is visible. Rows of a vehicle
are not independent: `+-`, the standard error of NEES, is by vehicles.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow.parquet

from vidtrack import formats
from vidtrack.config.load import load
from vidtrack.run.files import run_file
from vidtrack.score.clear import correspondences
from vidtrack.score.consistency import nees
from vidtrack.score.matching import match_boxes
from vidtrack.simulate import simulate, simulate_road, write, write_road

IOU = 0.3
AREAS = (0, 100, 200, 400, 800, np.inf)


def draw(options: argparse.Namespace, seed: int, folder: Path) -> None:
    """Write the video of a seed and its truth."""
    size = None if options.size is None else tuple(map(int, options.size.split("x")))
    if options.scene == "junction":
        write(simulate("junction", seed=seed, size=size), folder)
    else:
        write_road(simulate_road(options.scene, seed=seed, size=size, seconds=options.seconds), folder)


def rows(seed: int, folder: Path, options: argparse.Namespace) -> dict[str, np.ndarray]:
    """What is known of each matched row of a seed."""
    folder.mkdir()
    draw(options, seed, folder)
    with run_file(str(folder / "video.avi"), load(assignments=options.set), folder / "run") as run:
        for _ in run:
            pass
    found, status = formats.read_states(folder / "run"), pyarrow.parquet.read_table(folder / "run" / "tracks.parquet")
    truth = formats.read(folder / "gt.txt")
    visible = np.loadtxt(folder / "gt.txt", delimiter=",", usecols=8)
    matched = match_boxes(found, truth)
    pairs = correspondences(matched, IOU)
    own, true = matched.result[pairs], matched.truth[pairs]
    assert found.cov is not None
    assert truth.box is not None
    return {
        "nees": nees(found, truth, own, true),
        "square": ((found.xy[own] - truth.xy[true]) ** 2).sum(axis=1),
        "stated": np.trace(found.cov[own], axis1=1, axis2=2),
        "status": status["status"].to_numpy(zero_copy_only=False)[own].astype(str),
        "area": truth.box[true, 2:].prod(axis=1),
        "visible": visible[true],
        "vehicle": 1000 * seed + truth.id[true],
    }


def kinds(known: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """Name and mask of each kind of row."""
    yield "all", np.ones(len(known["nees"]), bool)
    for status in ("tentative", "confirmed", "coasting", "merged"):
        yield status, known["status"] == status
    yield "less than 200 px2", known["area"] < 200
    for low, high in pairwise(AREAS):
        yield f"{low:g} to {high:g} px2", (known["area"] >= low) & (known["area"] < high)
    yield "less than 90 % visible", known["visible"] < 0.9
    yield "at least 90 % visible", known["visible"] >= 0.9


def standard_error(values: np.ndarray, group: np.ndarray) -> float:
    """Standard error of the mean of values (K,) that depend on each other within a group (K,)."""
    _, own = np.unique(group, return_inverse=True)
    return float(np.linalg.norm(np.bincount(own, values - values.mean())) / len(values))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="junction")
    parser.add_argument("--size", metavar="WxH", help="pixels of the picture")
    parser.add_argument("--seconds", type=float, help="of the video; not of the junction")
    parser.add_argument("--seeds", default="101-110", metavar="FIRST-LAST")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=VALUE", help="one setting")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split("-"))
    with tempfile.TemporaryDirectory() as place:
        each = [rows(seed, Path(place, str(seed)), arguments) for seed in range(first, last + 1)]
    known = {name: np.concatenate([one[name] for one in each]) for name in each[0]}
    sys.stdout.write(f"{'':24}{'NEES':>8}{'+-':>8}{'median':>8}{'rms':>8}{'stated':>8}{'rows':>8}{'vehicles':>10}\n")
    for name, mask in kinds(known):
        if mask.any():
            value, vehicle = known["nees"][mask], known["vehicle"][mask]
            rms, stated = (known[key][mask].mean() ** 0.5 for key in ("square", "stated"))
            error, vehicles = standard_error(value, vehicle), len(np.unique(vehicle))
            sys.stdout.write(f"{name:24}{value.mean():8.2f}{error:8.2f}{np.median(value):8.2f}")
            sys.stdout.write(f"{rms:8.2f}{stated:8.2f}{mask.sum():8d}{vehicles:10d}\n")


if __name__ == "__main__":
    main()
