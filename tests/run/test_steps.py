"""Stored scans through a tracker."""

import numpy as np

import vidtrack as vt
from vidtrack.config.settings import Settings
from vidtrack.run.radar import run_plots
from vidtrack.run.steps import scan_steps


def scans(rng, count=30):
    """Two targets, each with one to three plots a scan, and empty scans."""
    for k in range(count):
        place = np.array([[10.0 * k, 0.0], [500.0 + 10.0 * k, 0.0]])
        z = np.repeat(place, rng.integers(1, 4, 2), axis=0)
        z = z + 3 * rng.normal(size=z.shape) if k % 10 != 5 else np.empty((0, 2))
        yield k, vt.Scan(float(k), z, 9 * np.eye(2))


def test_redundant_plots_make_no_tracks_of_their_own():
    found = {}
    for redundant in (None, 0.99):
        tracker = vt.Tracker(vt.ConstantVelocity(accel=1.0, speed=20.0))
        steps = list(scan_steps(scans(np.random.default_rng(0)), tracker, redundant))
        assert [step.index for step in steps] == list(range(30))
        found[redundant] = {event.track_id for step in steps for event in step.tracks.events if event.kind == "birth"}
    assert len(found[0.99]) < len(found[None]) / 2
    assert len(steps[-1].tracks) == 2


def test_a_radar_run_combines_them_when_asked(tmp_path):
    lines = ["scan,time_s,x_m,y_m"]
    lines += [f"{k},{4 * k},{1000 + 400 * k + 60 * i},5000" for k in range(20) for i in range(2)]
    (tmp_path / "plots.csv").write_text("\n".join(lines) + "\n")
    tracks = {}
    for redundant in (None, 0.99):
        settings = Settings.model_validate({"tracker": {"redundant": redundant}})
        with run_plots(str(tmp_path / "plots.csv"), settings, tmp_path / f"run-{redundant}") as run:
            tracks[redundant] = len({int(i) for step in run for i in step.tracks.id})
    assert tracks == {None: 2, 0.99: 1}
