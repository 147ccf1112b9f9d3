"""Real maritime radar: a scenario of the Autoferry sensor fusion data set as plots.csv and truth.csv.

    python tools/read_autoferry.py autoferry/scenario16 -o DIR

The radar (sensor 2) of a slow boat sees two boats with GNSS receivers that manoeuvre, and other things; 48 to 83 scans,
1.7 s apart (Helgesen, Vasstein, Brekke, Stahl, "Heterogeneous multi-sensor tracking for an autonomous surface vehicle
in a littoral environment", Ocean Engineering 252, 2022; CC0). In the files positions are north and east, of plots from
the own boat; here x is east and y north from a point at rest, in metres, and times are seconds from the first scan.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

RADAR = 2
SIGMA_M = 6.0
"""Standard deviation that the plots are given: half the distance of the range cells."""


def write_autoferry(scenario: Path, folder: Path) -> None:
    """Write plots.csv and truth.csv of SCENARIO_detections.json and SCENARIO_groundTruth.json into a folder."""
    looks, truths = (
        json.loads(scenario.with_name(f"{scenario.name}_{kind}.json").read_text())
        for kind in ("detections", "groundTruth")
    )
    own = [(look, truth) for look, truth in zip(looks, truths, strict=True) if look["sensorID"] == RADAR]
    plots, boats = [], []
    for scan, (look, truth) in enumerate(own):
        time_s = look["time"] - own[0][0]["time"]
        north_east = np.asarray(look["measurement"], float).reshape(2, -1).T + look["ownshipPosition"]
        plots += [(scan, time_s, east, north, SIGMA_M, SIGMA_M) for north, east in north_east]
        boats += [(scan, time_s, boat["targetID"], *boat["position"][1::-1]) for boat in truth]
    folder.mkdir(parents=True, exist_ok=True)
    header = "scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m"
    np.savetxt(folder / "plots.csv", plots, fmt="%d,%.6f,%.3f,%.3f,%g,%g", header=header, comments="")
    header = "scan,time_s,target_id,x_m,y_m"
    np.savetxt(folder / "truth.csv", boats, fmt="%d,%.6f,%d,%.3f,%.3f", header=header, comments="")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", type=Path, help="path of the scenario's files without _detections.json")
    parser.add_argument("-o", "--output", type=Path, default=Path("autoferry"))
    arguments = parser.parse_args()
    write_autoferry(arguments.scenario, arguments.output)


if __name__ == "__main__":
    main()
