"""What a simulated radar saw as files: plots.csv and truth.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays.types import Floats, Mask
from vidtrack.simulate.radar import Seen

MEASURED = ("range_m", "azimuth_deg", "elevation_deg")
STATES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")

Columns = dict[str, tuple[str, NDArray]]
"""A table: each column's format and values."""


def write_radar(seen: Seen, folder: Path) -> None:
    """Write plots.csv and truth.csv into a folder that exists."""
    write_plots(folder / "plots.csv", seen)
    write_truth(folder / "truth.csv", seen.times, seen.states, seen.there)


def write_plots(path: Path, seen: Seen) -> None:
    """Write `scan,time_s,range_m,azimuth_deg[,elevation_deg],sigma_...[,amplitude]`, in order of scan and azimuth."""
    dim = seen.radar.dim
    columns: Columns = {"scan": ("%d", seen.scan), "time_s": ("%.6f", seen.time_s)}
    columns |= {name: ("%.4f" if k == 0 else "%.6f", seen.z[:, k]) for k, name in enumerate(MEASURED[:dim])}
    columns |= {
        f"sigma_{name}": ("%g", np.full(len(seen.scan), seen.radar.sigma[k])) for k, name in enumerate(MEASURED[:dim])
    }
    if not np.isnan(seen.amplitude).any():
        columns["amplitude"] = ("%.5f", seen.amplitude)
    _save(path, columns)


def write_truth(path: Path, times: Floats, states: Floats, there: Mask) -> None:
    """Write `scan,time_s,target_id,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s`, ids from 1.

    times (K,) of the scans, states (targets, K, 6), there (targets, K) where a target is in the coverage
    """
    scan, target = np.nonzero(there.T)
    states = states[target, scan]
    columns: Columns = {"scan": ("%d", scan), "time_s": ("%.6f", times[scan]), "target_id": ("%d", target + 1)}
    _save(path, columns | {name: ("%.4f", states[:, k]) for k, name in enumerate(STATES)})


def _save(path: Path, columns: Columns) -> None:
    """A CSV table; each column has its format."""
    formats, values = zip(*columns.values(), strict=True)
    np.savetxt(path, np.column_stack(values), fmt=",".join(formats), header=",".join(columns), comments="")
