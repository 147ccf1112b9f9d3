"""A run whose tracks are exact states on the road, as `vidtrack measure` reads it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

SIGMA = 0.01  # of exact states, in the units of their columns


def write_exact_run(
    folder: Path, states: dict[str, np.ndarray], boxes: np.ndarray, fps: float, size: tuple[int, int], media_s: float
) -> None:
    """Write tracks.parquet and summary.json.

    states  (N,) in order of time: time_s, track_id, x_m, y_m, speed_kmh, heading_deg (clockwise from north), length_m,
            width_m
    boxes   (N, 4) px; left, top, width, height
    size    width and height of the picture, px; media_s: time of its last frame
    """
    count = len(boxes)
    small, none = np.full(count, SIGMA), np.zeros(count)
    table = states | {
        "track_id": states["track_id"].astype(np.int64),
        "status": np.full(count, "confirmed"),
        **dict.fromkeys(("sigma_x_m", "sigma_y_m", "speed_sigma_kmh", "length_sigma_m"), small),
        **dict.fromkeys(("corr_xy_m", "speed_shared_sigma_kmh"), none),
        **dict.fromkeys(("x_px", "y_px", "vx_px_s", "vy_px_s", "sigma_x_px", "sigma_y_px"), none),
        **dict(zip(("left_px", "top_px", "width_px", "height_px"), boxes.T, strict=True)),
    }
    folder.mkdir()
    pq.write_table(pa.table(table), folder / "tracks.parquet")
    summary = {"frames": round(media_s * fps) + 1, "media_s": media_s, "fps": fps, "width": size[0], "height": size[1]}
    (folder / "summary.json").write_text(json.dumps(summary | {"settings": {"source": {"start_s": 0.0}}}))
