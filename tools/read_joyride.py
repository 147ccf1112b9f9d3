"""Real maritime radar: the plots of the Joyride data set as plots.csv and truth.csv.

    python tools/read_joyride.py joyride.mat -o DIR

238 scans of an X-band radar, about 2.5 s apart, 432 plots, and the track of a fast boat that manoeuvres, as its own
GNSS receiver had it (Brekke, Hem, Tokle, "VIMMJIPDA", CC0). Positions are north and east in the file, x east and y
north here, in metres from a point of reference; times are seconds from the first scan.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import loadmat

SIGMA_M = 15.0
"""Standard deviation that the plots are given. Of the 191 plots nearest to the boat within 50 m, the deviation from
its track is 11 m along the line of sight and 12 m across, with an offset of 12 m across."""


@dataclass(frozen=True)
class Joyride:
    """Times (K,) of the scans; plots (N, 2) x, y and the scan (N,) of each; the boat (K, 4) x, y, vx, vy."""

    times: np.ndarray
    scan: np.ndarray
    plots: np.ndarray
    boat: np.ndarray


def read_joyride(path: Path) -> Joyride:
    """Read joyride.mat."""
    data = loadmat(path)
    times = data["time"].ravel()
    each = [plots[np.isfinite(plots).all(axis=1)] for plots in data["measurements"].ravel()]
    north_east = np.concatenate(each)
    north, v_north, east, v_east = data["target"].T
    return Joyride(
        times - times[0],
        np.repeat(np.arange(len(each)), [len(plots) for plots in each]),
        north_east[:, ::-1],
        np.column_stack([east, north, v_east, v_north]),
    )


def write_joyride(data: Joyride, folder: Path) -> None:
    """Write plots.csv and truth.csv into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    sigma = np.full((len(data.plots), 2), SIGMA_M)
    np.savetxt(
        folder / "plots.csv",
        np.column_stack([data.scan, data.times[data.scan], data.plots, sigma]),
        fmt="%d,%.6f,%.3f,%.3f,%g,%g",
        header="scan,time_s,x_m,y_m,sigma_x_m,sigma_y_m",
        comments="",
    )
    scans = np.arange(len(data.times))
    np.savetxt(
        folder / "truth.csv",
        np.column_stack([scans, data.times, np.ones(len(scans)), data.boat]),
        fmt="%d,%.6f,%d,%.3f,%.3f,%.4f,%.4f",
        header="scan,time_s,target_id,x_m,y_m,vx_m_s,vy_m_s",
        comments="",
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("joyride"))
    arguments = parser.parse_args()
    write_joyride(read_joyride(arguments.file), arguments.output)


if __name__ == "__main__":
    main()
