"""SUMO's floating car data: the vehicles of each moment, as its own simulations write them."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from vidtrack.output.export.road_run import RoadRun, Rows
from vidtrack.output.folder import replacing


def write(run: RoadRun, folder: Path) -> None:
    """Write fcd.xml: x, y in metres are the middle of the front bumper, angle is in degrees clockwise from north.

    Rows without a heading or a length have no front bumper and are left out.
    """
    types = {str(kind): quoteattr(str(kind)) for kind in np.unique(run.vehicles.kind)}
    with replacing(folder / "fcd.xml") as path, path.open("w", encoding="utf-8") as file:
        file.write('<?xml version="1.0" encoding="UTF-8"?>\n<fcd-export>\n')
        frame = -1
        for rows in run.batches():
            rows = rows.select(np.isfinite(rows.heading) & np.isfinite(rows.length))
            kinds = run.vehicles.kind[run.vehicles.row(rows.track)]
            for number, time, kind, line in zip(
                rows.frame.tolist(), rows.time.tolist(), kinds.tolist(), _vehicles(rows), strict=True
            ):
                if number != frame:
                    close = "    </timestep>\n" if frame >= 0 else ""
                    file.write(f'{close}    <timestep time="{time:.3f}">\n')
                    frame = number
                file.write(f"        {line} type={types[kind]}/>\n")
        file.write("    </timestep>\n" if frame >= 0 else "")
        file.write("</fcd-export>\n")


def _vehicles(rows: Rows) -> list[str]:
    values = (rows.track, *rows.front.T, np.degrees(rows.heading), rows.speed)
    return [
        f'<vehicle id="{track}" x="{x:.3f}" y="{y:.3f}" angle="{angle:.2f}" speed="{speed:.3f}"'
        for track, x, y, angle, speed in zip(*(value.tolist() for value in values), strict=True)
    ]
