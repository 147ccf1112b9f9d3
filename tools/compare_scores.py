"""Compare our scores with TrackEval and motmetrics on the MOT15 truth: prints the largest difference.

    python tools/compare_scores.py [--seeds N]

Result tracks are made from the truth of VIDTRACK_DATA/mot15 by a seeded generator: rows dropped, boxes
shaken, identities switched, false tracks added. TrackEval and motmetrics are installed by pip into a
temporary environment; neither is a dependency. Exits with 1 when a difference exceeds 1e-9.
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
    """Result tracks from truth: 12 % of rows dropped, boxes shaken by a tenth, identities swapped, false tracks."""
    kept = truth.select(rng.random(len(truth)) > 0.12)
    identity = kept.id.copy()
    for _ in range(10):  # from a frame on, two tracks carry each other's identity
        a, b = rng.choice(np.unique(identity), 2, replace=False)
        later = kept.frame >= rng.integers(kept.frame.max())
        swap = {a: b, b: a}
        identity[later] = [swap.get(i, i) for i in identity[later]]
    false = rng.random(len(kept)) < 0.08
    frame = np.concatenate([kept.frame, kept.frame[false]])
    identity = np.concatenate([identity, identity.max() + 1 + kept.id[false]])
    shaken = kept.box + rng.normal(0, 0.1, kept.box.shape) * kept.box[:, [2, 3, 2, 3]]
    stray = kept.box[false] + rng.normal(0, 0.4, (false.sum(), 4)) * kept.box[false][:, [2, 3, 2, 3]]
    box = np.concatenate([shaken, stray])
    box[:, 2:] = np.maximum(box[:, 2:], 1.0)
    return formats.box_table(frame, identity, box)


def compare(ours: dict, theirs: dict) -> dict[str, float]:
    """Absolute difference by score name."""
    return {name: abs(float(ours[name]) - value) for name, value in theirs.items()}


def main() -> int:
    """Make results, score them by all, print the differences."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2, help="perturbed results of every sequence (default 2)")
    seeds = parser.parse_args().seeds
    if "VIDTRACK_DATA" not in os.environ:
        parser.error("set VIDTRACK_DATA to the folder that holds mot15/")
    files = sorted((Path(os.environ["VIDTRACK_DATA"]) / "mot15").glob("*/gt/gt.txt"))

    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        venv.create(root / "env", with_pip=True)
        python = root / "env" / "bin" / "python"
        subprocess.run([python, "-m", "pip", "install", "--quiet", *PEERS], check=True)

        ours, runs, lengths = {}, [], {}
        for seed in range(seeds):
            for file in files:
                name = f"{file.parts[-3]}-{seed}"
                truth_file = root / "gt" / name / "gt" / "gt.txt"
                result_file = root / "results" / "ours" / "data" / f"{name}.txt"
                for made in (truth_file, result_file):
                    made.parent.mkdir(parents=True, exist_ok=True)
                truth_file.write_text(file.read_text())
                formats.write_mot(result_file, perturbed(formats.read(file), np.random.default_rng(seed)))
                runs.append((formats.read(result_file), formats.read(truth_file)))
                lengths[name] = int(runs[-1][1].frame.max()) + 1
                ours[name] = score.evaluate(*runs[-1])
        scored = [(result, truth.select(truth.conf != 0)) for result, truth in runs]
        ours[POOLED] = score.evaluate(*score.pool(scored))
        (root / "lengths.json").write_text(json.dumps(lengths))
        peers = subprocess.run([python, "-c", PEER_SCRIPT, folder], check=True, stdout=subprocess.PIPE, text=True)

    worst = 0.0
    for name, theirs in json.loads(peers.stdout).items():
        motmetrics = theirs.pop("motmetrics", {})
        trackeval = compare(ours[name], theirs)
        worst = max(worst, *trackeval.values())
        at = max(trackeval, key=trackeval.__getitem__)
        print(f"{name}: mota {ours[name]['mota']:.4f} idf1 {ours[name]['idf1']:.4f} hota {ours[name]['hota']:.4f}")
        print(f"    TrackEval, largest difference of {len(trackeval)} scores: {trackeval[at]:.2g} ({at})")
        for score_name, difference in compare(ours[name], motmetrics).items():
            print(f"    motmetrics {score_name}: {motmetrics[score_name]:.6g}, difference {difference:.2g}")
    print(f"largest difference from TrackEval: {worst:.3g} (allowed {TOLERANCE:g})")
    return 0 if worst <= TOLERANCE else 1


if __name__ == "__main__":
    sys.exit(main())
