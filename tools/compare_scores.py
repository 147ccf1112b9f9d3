"""Compare our scores with TrackEval and motmetrics on the MOT15 truth: prints the largest difference.

    python tools/compare_scores.py [--seeds N]

Result tracks are made from the truth of VIDTRACK_DATA/mot15 by a seeded generator: rows dropped, boxes
shaken, identities switched, false tracks added. TrackEval and motmetrics are installed by pip into a
temporary environment; neither is a dependency. Exits with 1 when a difference from TrackEval exceeds
1e-9. motmetrics is printed beside: its definition differs in that a match of any earlier frame is kept
before new ones are sought, so that it may count fewer switches.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import numpy as np

from vidtrack import formats, score
from vidtrack.formats import Table

TOLERANCE = 1e-9
PEERS = ("trackeval==1.3.0", "motmetrics==1.4.0")
POOLED = "COMBINED_SEQ"

# Runs in the peers' environment: scores of every sequence and of all pooled, as JSON.
PEER_SCRIPT = """
import contextlib, json, sys
from pathlib import Path
import motmetrics, numpy as np, trackeval

root = Path(sys.argv[1])
lengths = json.loads((root / "lengths.json").read_text())
quiet = {"PRINT_CONFIG": False}
dataset = trackeval.datasets.MotChallenge2DBox({
    **quiet, "GT_FOLDER": str(root / "gt"), "TRACKERS_FOLDER": str(root / "results"), "BENCHMARK": "MOT15",
    "SKIP_SPLIT_FOL": True, "TRACKERS_TO_EVAL": ["ours"], "SEQ_INFO": lengths})
metrics = [trackeval.metrics.HOTA(), trackeval.metrics.CLEAR({**quiet, "THRESHOLD": 0.5}),
           trackeval.metrics.Identity({**quiet, "THRESHOLD": 0.5})]
with contextlib.redirect_stdout(sys.stderr):
    found, _ = trackeval.Evaluator({
        **quiet, "PRINT_RESULTS": False, "OUTPUT_SUMMARY": False, "OUTPUT_DETAILED": False, "PLOT_CURVES": False,
        "TIME_PROGRESS": False, "BREAK_ON_ERROR": True,
    }).evaluate([dataset], metrics)

report = {}
for name, classes in found["MotChallenge2DBox"]["ours"].items():
    hota, clear, identity = (classes["pedestrian"][family] for family in ("HOTA", "CLEAR", "Identity"))
    report[name] = {
        "mota": clear["MOTA"], "motp": clear["MOTP"], "switches": clear["IDSW"], "fragmentations": clear["Frag"],
        "false_positives": clear["CLR_FP"], "misses": clear["CLR_FN"], "matches": clear["CLR_TP"],
        "mostly_tracked": clear["MT"], "partially_tracked": clear["PT"], "mostly_lost": clear["ML"],
        "idf1": identity["IDF1"], "idp": identity["IDP"], "idr": identity["IDR"],
        "hota": np.mean(hota["HOTA"]), "deta": np.mean(hota["DetA"]), "assa": np.mean(hota["AssA"]),
    }
    report[name] = {key: float(value) for key, value in report[name].items()}

for name in lengths:
    data = dataset.get_preprocessed_seq_data(dataset.get_raw_seq_data("ours", name), "pedestrian")
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for truth, result, iou in zip(data["gt_ids"], data["tracker_ids"], data["similarity_scores"]):
        accumulator.update(truth, result, np.where(iou >= 0.5, 1 - iou, np.nan))
    summary = motmetrics.metrics.create().compute(accumulator, metrics=["mota", "idf1", "num_switches"])
    mota, idf1, switches = summary.iloc[0]
    report[name]["motmetrics"] = {"mota": float(mota), "idf1": float(idf1), "switches": float(switches)}
print(json.dumps(report))
"""


def perturbed(truth: Table, rng: np.random.Generator) -> Table:
    """Result tracks from truth: 12 % of rows and eight whole frames dropped, boxes shaken, identities swapped,
    false tracks added.
    """
    blind = truth.frame - rng.integers(truth.frame.max() - 8)
    kept = truth.select((rng.random(len(truth)) > 0.12) & ((blind < 0) | (blind >= 8)))
    assert kept.box is not None  # MOT files always have boxes
    identity = kept.id.copy()
    for _ in range(10):  # from a frame on, two tracks carry each other's identity
        a, b = rng.choice(np.unique(identity), 2, replace=False)
        later = kept.frame >= rng.integers(kept.frame.max())
        swap = {a: b, b: a}
        identity[later] = [swap.get(i, i) for i in identity[later]]
    false = rng.random(len(kept)) < 0.08
    size = kept.box[:, [2, 3, 2, 3]]
    shaken = kept.box + 0.1 * size * rng.standard_normal(size.shape)
    stray = kept.box[false] + 0.4 * size[false] * rng.standard_normal(size[false].shape)
    box = np.concatenate([shaken, stray])
    box[:, 2:] = np.maximum(box[:, 2:], 1.0)
    frame = np.concatenate([kept.frame, kept.frame[false]])
    return formats.box_table(frame, np.concatenate([identity, identity.max() + 1 + kept.id[false]]), box)


def make_runs(root: Path, truths: list[Path], seeds: int) -> dict[str, tuple[Table, Table]]:
    """Write results and truth as TrackEval expects them below `root`; (result, truth) by name, read back."""
    runs = {}
    for seed in range(seeds):
        for source in truths:
            name = f"{source.parts[-3]}-{seed}"
            truth = root / "gt" / name / "gt" / "gt.txt"
            result = root / "results" / "ours" / "data" / f"{name}.txt"
            for path in (truth, result):
                path.parent.mkdir(parents=True, exist_ok=True)
            truth.write_text(source.read_text())
            formats.write_mot(result, perturbed(formats.read(source), np.random.default_rng(seed)))
            runs[name] = formats.read(result), formats.read(truth)
    lengths = {name: int(truth.frame.max()) + 1 for name, (_, truth) in runs.items()}
    (root / "lengths.json").write_text(json.dumps(lengths))
    return runs


def scores_of_peers(root: Path) -> dict[str, dict]:
    """Scores by name of run, from the peers in an environment of their own."""
    venv.create(root / "env", with_pip=True)
    python = root / "env" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PEERS], check=True)
    peers = subprocess.run([python, "-c", PEER_SCRIPT, root], check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(peers.stdout)


def print_differences(ours: dict[str, dict], theirs: dict[str, dict]) -> float:
    """Print every run's scores and differences; returns the largest difference from TrackEval."""
    worst = 0.0
    for name, peer in theirs.items():
        mine, motmetrics = ours[name], peer.pop("motmetrics", {})
        differences = {key: abs(mine[key] - value) for key, value in peer.items()}
        largest = max(differences.values())
        worst = max(worst, largest)
        print(f"{name}: mota {mine['mota']:.4f} idf1 {mine['idf1']:.4f} hota {mine['hota']:.4f}")
        print(f"    TrackEval: largest difference of {len(differences)} scores {largest:.2g}")
        for key, value in motmetrics.items():
            print(f"    motmetrics: {key} {value:.6g}, ours {mine[key]:.6g}")
    return worst


def main() -> int:
    """Make results, score them by all, print the differences."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2, help="perturbed results of every sequence (default 2)")
    seeds = parser.parse_args().seeds
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds mot15/")
    truths = sorted((Path(os.environ["VIDTRACK_DATA"]) / "mot15").glob("*/gt/gt.txt"))

    with tempfile.TemporaryDirectory() as folder:
        runs = make_runs(Path(folder), truths, seeds)
        theirs = scores_of_peers(Path(folder))
    ours = {name: score.evaluate(*run) for name, run in runs.items()}
    ours[POOLED] = score.evaluate(*score.pool(runs.values()))
    worst = print_differences(ours, theirs)
    print(f"largest difference from TrackEval: {worst:.3g} (allowed {TOLERANCE:g})")
    return 0 if worst <= TOLERANCE else 1


if __name__ == "__main__":
    sys.exit(main())
