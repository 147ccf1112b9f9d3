"""The tables of a day at a crossroads, as `vidtrack measure` writes them, with known counts, speeds and a gap."""

from __future__ import annotations

import json
from datetime import UTC, datetime

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.traffic.measures.tables import stamps, table

SITE = """
[site]
name = "{name}"
start = 2026-06-01T06:00:00+02:00
width = 1280
height = 720
{calibration}
[gates.north_in]
line = [[560, 180], [630, 180]]
leg = "north"
role = "entry"
[gates.north_out]
line = [[640, 180], [710, 180]]
leg = "north"
role = "exit"
[gates.east_in]
line = [[820, 280], [820, 350]]
leg = "east"
role = "entry"
[gates.east_out]
line = [[820, 360], [820, 430]]
leg = "east"
role = "exit"
[gates.south_in]
line = [[640, 540], [710, 540]]
leg = "south"
role = "entry"
[gates.south_out]
line = [[560, 540], [630, 540]]
leg = "south"
role = "exit"
[gates.west_in]
line = [[450, 360], [450, 430]]
leg = "west"
role = "entry"
[gates.west_out]
line = [[450, 280], [450, 350]]
leg = "west"
role = "exit"
[zones.box]
polygon = [[450, 180], [820, 180], [820, 540], [450, 540]]
[movements]
allowed = [["north", "south"], ["north", "east"], ["north", "west"], ["south", "north"], ["south", "west"],
  ["south", "east"], ["east", "west"], ["east", "north"], ["east", "south"], ["west", "east"], ["west", "north"],
  ["west", "south"]]
"""
CALIBRATION = """
[calibration]
picture = [[235, 0], [1035, 0], [235, 719], [1035, 719], [635, 360], [435, 180]]
ground = [[-40, 36], [40, 36], [-40, -35.9], [40, -35.9], [0, 0], [-20, 18]]
sigma_picture_px = 0.5
"""
"""From straight above, 10 px a metre."""
INTERVAL_S = 900.0
TRIP_S = 8.0
FPS, SPEED = 10.0, 45.0
"""of `write_run`; px/s: 8 s from the north gate to the south gate"""


def write_day(folder, counts, coverage=None, speeds=None, queues=(), legs=("north", "south"), close=None, **changed):
    """Write a folder of measures and give it back.

    counts    (I, M) whole trips of M movements in intervals from 06:00 on
    legs      pairs (from, to) of these movements; one pair: of them all
    coverage  (I,) 1: all
    speeds    km/h of crossings of the gate south_out; None: no speeds
    queues    rows leg, begin_s, end_s, vehicles, length_m
    close     rows kind, ttc_s, pet_s; None: no table of conflicts
    changed   of measures.json; `name` of the site; `metres` False: a site without calibration
    """
    counts = np.asarray(counts, int).reshape(len(counts), -1)
    pairs = [legs] if isinstance(legs[0], str) else list(legs)
    bins = len(counts)
    coverage = np.ones(bins) if coverage is None else np.asarray(coverage, float)
    edges = np.arange(bins + 1) * INTERVAL_S
    begin, movement = [], []
    for i, m in np.ndindex(*counts.shape):
        begin.append(edges[i] + INTERVAL_S * max(coverage[i], 0.01) * (np.arange(counts[i, m]) + 0.5) / counts[i, m])
        movement.append(np.full(counts[i, m], m))
    begin, movement = np.concatenate(begin), np.concatenate(movement)
    order = np.argsort(begin, kind="stable")
    begin, movement = begin[order], movement[order]
    whole = [pairs[m] for m in movement]
    metres, name = changed.pop("metres", True), changed.pop("name", "Old Mill Road")
    utc = datetime(2026, 6, 1, 4, tzinfo=UTC)
    speeds = np.empty(0) if speeds is None else np.asarray(speeds, float)
    queued = list(zip(*queues, strict=True)) or [[]] * 5
    entered = np.histogram(begin, edges)[0]
    tables = {
        "crossings": table(
            {
                "time_s": ("s", np.linspace(0, edges[-1], len(speeds))),
                "gate": ("", ["south_out"] * len(speeds)),
                "direction": ("", ["down"] * len(speeds)),
                "speed_kmh": ("km/h", speeds),
                "speed_sigma_kmh": ("km/h", np.ones(len(speeds))),
                "speed_shared_sigma_kmh": ("km/h", np.full(len(speeds), 0.5)),
            }
        ),
        "trips": table(
            {
                "run": ("n", np.zeros(len(begin))),
                "track_id": ("n", np.arange(len(begin)) + 1),
                "from_leg": ("", [pair[0] for pair in whole]),
                "to_leg": ("", [pair[1] for pair in whole]),
                "begin_s": ("s", begin),
                "end_s": ("s", begin + TRIP_S),
                "begin_utc": ("utc", stamps(utc, begin)),
                "complete": ("yes", [None not in pair for pair in whole]),
                "reason": ("", ["" if None not in pair else "ended between the gates" for pair in whole]),
            }
        ),
        "queues": table(
            {
                "leg": ("", list(queued[0])),
                "begin_s": ("s", queued[1]),
                "end_s": ("s", queued[2]),
                "vehicles": ("n", queued[3]),
                "length_m": ("m", queued[4]),
            }
        ),
        "checks": table(
            {
                "begin_s": ("s", edges[:-1]),
                "end_s": ("s", edges[1:]),
                "coverage": ("1", coverage),
                **{
                    name: ("n", np.where(coverage > 0, values, np.nan))
                    for name, values in {
                        "inflow": entered,
                        "outflow": entered,
                        **dict.fromkeys(("stored", "left_over", "appeared", "vanished"), 0.0 * entered),
                    }.items()
                },
            }
        ),
    }
    if close is not None:
        kind, ttc, pet = zip(*close, strict=True) if close else ([], [], [])
        ones = np.ones(len(kind))
        tables["conflicts"] = table(
            {
                "time_s": ("s", 60.0 * np.arange(len(kind))),
                "kind": ("", list(kind)),
                **dict.fromkeys(("angle_deg", "first_speed_kmh", "second_speed_kmh"), ("1", 30 * ones)),
                **dict.fromkeys(("first_track_id", "second_track_id"), ("n", ones)),
                **{"ttc_s": ("s", ttc), "ttc_sigma_s": ("s", 0.2 * ones)},
                **{"pet_s": ("s", pet), "pet_sigma_s": ("s", 0.4 * ones)},
                "reason": ("", ["seen"] * len(kind)),
            }
        )
    report = {
        "site": name,
        "metres": metres,
        "runs": [{"folder": "gone", "begin_s": 0.0, "end_s": float(edges[-1]), "run": 0}],
        "utc_of_time_0": utc.isoformat(),
        "watched_s": float(coverage.sum() * INTERVAL_S),
        "tracks": len(begin),
        "joins": 0,
        "impossible_movements": [],
        "calibration": [],
        "scale": None,
        "straightness": None,
        "sections": [],
        **changed,
    }
    folder.mkdir(parents=True, exist_ok=True)
    for table_name, content in tables.items():  # as Parquet only: the CSV of measures refuses names that no site has
        pq.write_table(content, folder / f"{table_name}.parquet")
    (folder / "measures.json").write_text(json.dumps(report), encoding="utf-8")
    calibration = CALIBRATION if metres else ""
    (folder / "site.toml").write_text(SITE.format(name="site", calibration=calibration), encoding="utf-8")
    return folder


MOVEMENTS = [(a, b) for a in ("north", "east", "south", "west") for b in ("north", "east", "south", "west") if a != b]


def busy_day(folder):
    """06:00 to 22:00 with two peaks, all movements, an unwatched hour, a half-watched interval, speeds and queues."""
    random = np.random.default_rng(5)
    hour = 6 + (np.arange(64) + 0.5) / 4
    shape = 0.3 + np.exp(-(((hour - 8) / 0.8) ** 2)) + 0.8 * np.exp(-(((hour - 17) / 1.5) ** 2))
    weight = np.array([4, 30, 6, 5, 4, 12, 28, 5, 3, 8, 10, 4])
    coverage = np.ones(64)
    coverage[24:28], coverage[28] = 0, 0.5
    counts = random.poisson(shape[:, None] * weight * coverage[:, None])
    queues = [
        ("north", b, b + 60, n, 6.5 * n)
        for b, n in zip(range(5400, 9000, 300), [2, 5, 8, 9, 9, 7, 6, 4, 3, 2, 2, 1], strict=True)
    ]
    return write_day(folder, counts, coverage, random.normal(48, 7, 3000).clip(5), queues, MOVEMENTS)


def write_run(folder, begin_s):
    """Track 1 passes the gate north_in at begin_s and south_out 8 s later; track 2 stands aside all the time."""
    t = np.arange(0, 60, 1 / FPS)
    on = (t > begin_s - 1.05) & (t < begin_s + 9.05)
    ours, still = t[on], np.ones(len(t))
    x, y = np.append(595 * np.ones(len(ours)), 700 * still), np.append(180 + SPEED * (ours - begin_s), 300 * still)
    columns = {
        "time_s": np.append(ours, t),
        "track_id": np.append(np.ones(len(ours), int), 2 * still.astype(int)),
        "status": ["confirmed"] * (len(ours) + len(t)),
        **{"x_px": x, "y_px": y, "left_px": x - 0.5, "top_px": y - 0.8},
        **{
            name: np.ones(len(ours) + len(t))
            for name in ("vx_px_s", "vy_px_s", "sigma_x_px", "sigma_y_px", "width_px", "height_px")
        },
    }
    folder.mkdir()
    pq.write_table(pa.table(columns).sort_by("time_s"), folder / "tracks.parquet")
    summary = {"frames": len(t), "media_s": t[-1], "fps": FPS, "width": 1280, "height": 720}
    (folder / "summary.json").write_text(json.dumps(summary | {"settings": {"source": {"start_s": None}}}))
