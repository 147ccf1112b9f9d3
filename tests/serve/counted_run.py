"""A run over a small video with a known vehicle or two, counted over a line, and measured at a site."""

from __future__ import annotations

import json

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from vidtrack.config.settings import Settings
from vidtrack.output.figures import write_figures
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.site import read_site

SIZE, FPS, SECONDS = (320, 240), 25.0, 6
CAR, GREY, WHITE = (40, 20), 70, 230
SITE = """[site]
name = "yard"
width = 320
height = 240
[gates.middle]
line = [[160, 0], [160, 239]]
[gates.late]
line = [[260, 0], [260, 239]]
"""


def place(t):
    """Left edge and top [px] of the one car, which drives to the right."""
    return 20 + 50.0 * t, 100.0


def write_video(path):
    """The car, white on grey."""
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=round(FPS))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for k in range(round(SECONDS * FPS)):
            picture = np.full((SIZE[1], SIZE[0], 3), GREY, np.uint8)
            left, top = (round(edge) for edge in place(k / FPS))
            picture[top : top + CAR[1], left : left + CAR[0]] = WHITE
            file.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))
        file.mux(stream.encode())


def write_run(folder, video, lines=()):
    """A finished run: track 1 is the car, track 2 the same one again, 4 px behind; both cross each line of `lines`."""
    folder.mkdir(parents=True)
    t = np.repeat(np.arange(round(SECONDS * FPS)) / FPS, 2)
    track = np.tile([1, 2], len(t) // 2)
    left = place(t)[0] - 4.0 * (track == 2)
    ones = np.ones(len(t))
    columns = {
        "frame": np.rint(t * FPS).astype(int),
        "time_s": t,
        "track_id": track,
        "status": np.where(track == 1, "confirmed", "merged"),
        "x_px": left + CAR[0] / 2,
        "y_px": 110 * ones,
        "vx_px_s": 50 * ones,
        "vy_px_s": 0 * ones,
        **{"sigma_x_px": 0.5 * ones, "sigma_y_px": 0.5 * ones},
        **{"left_px": left, "top_px": 100 * ones, "width_px": CAR[0] * ones, "height_px": CAR[1] * ones},
    }
    pq.write_table(pa.table(columns), folder / "tracks.parquet")
    settings = Settings().model_dump(mode="json")
    settings["output"]["lines"] = [f"{name}:{x},0,{x},239" for name, x in lines]
    size = {"width": SIZE[0], "height": SIZE[1]}
    summary = {"source": str(video), "fps": FPS, **size, "frames": len(t) // 2, "media_s": float(t[-1])}
    (folder / "summary.json").write_text(json.dumps(summary | {"settings": settings}))
    rows = [f"{(x - 40) / 50 + 0.08 * k:.6f},0,{name},right,{k + 1}\n" for name, x in lines for k in (0, 1)]
    if lines:
        (folder / "counts.csv").write_text("time_s,frame,line,direction,track_id\n" + "".join(rows))
    (folder / "decisions.csv").write_text(
        "frame,time_s,track_id,event,measurement,weight,d2,gate,runner_up,runner_up_d2,candidates,reason\n"
        "0,0.000000,1,birth,,,,,,,,measurement 0 belongs to no track\n"
        "1,0.040000,1,update,0,1,0.5,13.8,,,0:1:0.5,\n"
        "60,2.400000,1,update,0,1,0.25,13.8,,,0:1:0.25,\n"
        "60,2.400000,2,miss,,0,,13.8,,,,\n"
    )
    return folder


def write_measures(folder, run, start=None):
    """The run measured: the two tracks pass two gates to the right; `start` of the site, in TOML."""
    folder.mkdir()
    text = SITE if start is None else SITE.replace("[gates.middle]", f"start = {start}\n[gates.middle]")
    (folder / "site.toml").write_text(text)
    found = measured([str(run)], read_site(folder / "site.toml"))
    write_figures(folder, found.tables, found.report)
    return folder
