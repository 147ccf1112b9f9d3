"""Finished runs with tracks that are known, and sites to measure them at."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.traffic.site import Site

FPS = 25.0
SIZE = (640, 480)
SITE = {
    "site": {"name": "yard", "width": SIZE[0], "height": SIZE[1], "start": "2026-06-01T07:00:00+02:00"},
    "gates": {
        "west": {"line": [[100, 0], [100, 479]], "role": "entry"},
        "middle": {"line": [[300, 0], [320, 200], [300, 479]]},
        "east": {"line": [[500, 479], [500, 0]], "role": "exit"},
    },
    "report": {"interval_s": 10},
}
CALIBRATED = SITE | {
    "calibration": {  # 10 px/m, seen from above
        "picture": [[0, 0], [639, 0], [639, 479], [0, 479], [320, 10], [320, 400], [20, 240], [600, 240]],
        "ground": [[0, 48], [63.9, 48], [63.9, 0.1], [0, 0.1], [32, 47], [32, 8], [2, 24], [60, 24]],
    }
}


def site(tree=None, **more):
    """A site; by default without a calibration."""
    return Site.model_validate((tree or SITE) | more)


def straight(track, start_s, x, y, speed_px, seconds):
    """A track (id, times, positions) that drives to the right."""
    t = start_s + np.arange(round(seconds * FPS) + 1) / FPS
    return track, t, np.column_stack([x + speed_px * (t - start_s), np.full(len(t), float(y))])


def along(track, t, x, y=240.0):
    """A track at given places."""
    x = np.asarray(x, float)
    return track, np.asarray(t, float), np.column_stack([x, np.broadcast_to(np.asarray(y, float), x.shape)])


def write_run(
    folder,
    tracks,
    *,
    seconds=60.0,
    metres=False,
    covariances=False,
    csv=False,
    length_m=4.0,
    began=None,
    status=None,
    first=0.0,
    watched=None,
):
    """A finished run of these tracks (id, times (N,), positions (N, 2) px), in order of frames.

    metres  at 10 px/m, seen from above; first: its first frame [s]
    covariances  of the whole state, so that metres of any site can be computed
    status  (N,) words for all tracks, None: confirmed
    watched as in summary.json; None: as earlier versions, without
    """
    folder.mkdir(parents=True)
    t = np.concatenate([one[1] for one in tracks] or [np.empty(0)])
    xy = np.concatenate([one[2] for one in tracks] or [np.empty((0, 2))])
    ids = np.repeat([one[0] for one in tracks], [len(one[1]) for one in tracks]).astype(np.int64)
    v = np.concatenate([np.gradient(one[2], one[1], axis=0) for one in tracks] or [np.empty((0, 2))])
    words = np.full(len(t), "confirmed") if status is None else np.tile(status, len(tracks))
    ones = np.ones(len(t))
    columns = {
        "frame": np.rint(t * FPS).astype(np.int64),
        "time_s": t,
        "track_id": ids,
        "status": words,
        **{"x_px": xy[:, 0], "y_px": xy[:, 1], "vx_px_s": v[:, 0], "vy_px_s": v[:, 1]},
        **dict.fromkeys(("sigma_x_px", "sigma_y_px"), 0.5 * ones),
        **{"left_px": xy[:, 0] - 20, "top_px": xy[:, 1] - 15, "width_px": 40 * ones, "height_px": 20 * ones},
    }
    if covariances:
        columns |= dict.fromkeys(("sigma_vx_px_s", "sigma_vy_px_s"), ones)
        columns |= dict.fromkeys(("corr_xy", "corr_vxy", "corr_x_vx", "corr_x_vy", "corr_y_vx", "corr_y_vy"), 0 * ones)
    if metres:
        columns |= {
            **{"x_m": xy[:, 0] / 10, "y_m": 48 - xy[:, 1] / 10},
            **{"sigma_x_m": 0.05 * ones, "sigma_y_m": 0.05 * ones, "corr_xy_m": 0 * ones},
            **{"speed_kmh": 0.36 * np.hypot(*v.T), "speed_sigma_kmh": ones, "speed_shared_sigma_kmh": 0.5 * ones},
            "heading_deg": np.degrees(np.arctan2(v[:, 0], -v[:, 1])),
            **{"length_m": length_m * ones, "length_sigma_m": 0.2 * ones, "width_m": 2 * ones},
        }
    order = np.lexsort((ids, t))
    table = pa.table({name: pa.array(np.asarray(values)[order]) for name, values in columns.items()})
    if csv:
        text = [",".join(columns), *(",".join(map(str, row.values())) for row in table.to_pylist())]
        (folder / "tracks.csv").write_text("\n".join(text) + "\n")
    else:
        pq.write_table(table, folder / "tracks.parquet", row_group_size=100)
    summary = {
        **{"frames": round((seconds - first) * FPS), "media_s": seconds - 1 / FPS, "fps": FPS},
        **{"width": SIZE[0], "height": SIZE[1]},
        "settings": {"source": {"start_s": None if first == 0 or began else first}},
    }
    more = {"began": began, "watched": watched}
    (folder / "summary.json").write_text(json.dumps(summary | {name: value for name, value in more.items() if value}))
    return str(folder)
