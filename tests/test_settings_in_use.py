"""A setting that has no effect on the input at hand is refused when somebody asks for it."""

from pathlib import Path

import pytest
from settings_tree import places

from vidtrack.config.explain import as_toml
from vidtrack.config.group import Group
from vidtrack.config.inputs import Input, needs, reads
from vidtrack.config.load import load, value_of
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError
from vidtrack.run.files import run_file
from vidtrack.run.radar import run_plots
from vidtrack.run.run import Extras
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar

SAMPLES = Path(__file__).parents[1] / "samples"


@pytest.fixture
def read(monkeypatch):
    """The settings that were read, as (class, name)."""
    seen = set()

    def get(self, name):
        seen.add((type(self), name))
        return object.__getattribute__(self, name)

    monkeypatch.setattr(Group, "__getattribute__", get, raising=False)
    return seen


def refused(kind, *assignments, file=None):
    with pytest.raises(ConfigError) as error:
        load(file, assignments, kind=kind)
    return str(error.value)


def track_video(folder):
    source, lines = ("source.end_s", 1.0), ("output.lines", ["a:10,10,100,100"])
    pictures = Extras(rerun=str(folder / "run.rrd"), video=folder / "run.mp4")
    return run_file(str(SAMPLES / "crossing.avi"), load(assignments=[source, lines]), folder / "run", pictures)


def track_detections(folder):
    rows = [f"{k},-1,{10 + 3 * k},{20 + y},20,10,{0.5 + 0.01 * k},-1,-1,-1" for k in range(1, 40) for y in (0, 60)]
    (folder / "det.txt").write_text("\n".join(rows))
    chosen = load(assignments=[("source.fps", 25), ("output.lines", ["a:10,10,100,100"])])
    return run_file(str(folder / "det.txt"), chosen, folder / "run", Extras(rerun=str(folder / "run.rrd")))


def track_plots(folder):
    write_radar(simulate_radar("radar-tws", 0), folder)
    return run_plots(str(folder / "plots.csv"), load(), folder / "run", Extras(rerun=str(folder / "run.rrd")))


OF_THE_FILE = {"radar.skip_bad_rows", "radar.position", *(f"radar.sigma_{name}" for name in (
    "range_m", "azimuth_deg", "elevation_deg", "position_m", "doppler_m_s")),
    "radar.geodetic", "radar.sac", "radar.sic", "radar.scan_s"}  # fmt: skip
"""What is read only where a file leaves it open, or only of recordings."""


@pytest.mark.parametrize(
    ("kind", "track"),
    [(Input.VIDEO, track_video), (Input.DETECTIONS, track_detections), (Input.RADAR, track_plots)],
)
def test_what_is_said_to_have_an_effect_is_read(kind, track, tmp_path, read):
    with track(tmp_path) as run:
        for _ in run:
            pass
    fresh = Settings()
    idle = []
    for name, place in list(places()):
        useful = reads(kind, name) and all(value_of(fresh, other) in values for other, values in needs(kind, name))
        if useful and name not in OF_THE_FILE and place not in read:
            idle.append(name)
    assert idle == []


@pytest.mark.parametrize(
    ("kind", "assignment", "nearest"),
    [
        (Input.RADAR, "tracker.coast_s=2", "radar.coast_scans"),
        (Input.RADAR, "tracker.accel=2", "radar.accel"),
        (Input.RADAR, "tracker.life=llr", "radar.life"),
        (Input.RADAR, "tracker.euclidean_radius_px=2", "radar.euclidean_radius_m"),
        (Input.DETECTIONS, "tracker.confirm_hits=2", "detections.confirm_hits"),
        (Input.VIDEO, "detections.box_s=1", "tracker.box_s"),
        (Input.CAMERA, "radar.accel=1", "tracker.accel"),
    ],
)
def test_a_setting_of_another_input_is_refused_with_the_nearest_that_has_an_effect(kind, assignment, nearest):
    name = assignment.partition("=")[0]
    assert refused(kind, assignment) == f"setting {name} has no effect on {kind}; the nearest that has is {nearest}"


def test_a_setting_that_another_one_switches_off_is_refused():
    said = "setting tracker.n_scan has no effect with tracker.method=gnn; it needs tracker.method=split or mht"
    assert refused(Input.VIDEO, "tracker.n_scan=3") == said
    assert load(assignments=["tracker.n_scan=3", "tracker.method=mht"], kind=Input.VIDEO).tracker.n_scan == 3
    assert "radar.life=llr" in refused(Input.RADAR, "tracker.false_track=0.01", "radar.life=m-of-n")
    assert "detector.kind=disturbance" in refused(Input.VIDEO, "detector.kind=mog2", "detector.disturbance.holes=false")
    assert "output.link=true" in refused(Input.VIDEO, "output.link_s=2")
    assert load(assignments=["output.link_s=2"], kind=Input.DETECTIONS).output.link_s == 2
    assert "preview_s=a number above zero" in refused(
        Input.VIDEO, "detector.disturbance.patches=true", "detector.disturbance.preview_s=0"
    )


@pytest.mark.parametrize("name", ["merged_blobs=false", "parts=false", "group_cover=0.5", "blob_overlap=0.4"])
@pytest.mark.parametrize("method", ["mht", "split"])
def test_settings_of_shared_blobs_are_refused_where_decisions_are_made_later(name, method):
    """Methods that decide some scans later know no shared blobs."""
    said = refused(Input.VIDEO, f"tracker.{name}", f"tracker.method={method}")
    assert f"no effect with tracker.method={method}" in said
    assert load(assignments=[f"tracker.{name}", "tracker.method=jpda"], kind=Input.VIDEO)


def test_only_stored_detections_are_smoothed_by_default():
    assert "output.smooth=true" in refused(Input.VIDEO, "output.smooth_lag_s=2")
    unlinked = ("output.smooth_lag_s=2", "output.link=false")
    assert "output.smooth" in refused(Input.DETECTIONS, *unlinked, "output.smooth=false")
    assert load(assignments=unlinked, kind=Input.DETECTIONS).output.smooth_lag_s == 2
    assert "output.link=false" in refused(Input.DETECTIONS, "output.smooth_lag_s=2")
    assert "output.link=false" in refused(
        Input.VIDEO, "output.smooth=true", "output.smooth_lag_s=2", "output.link=true"
    )
    assert "output.smooth has no effect on a camera" in refused(Input.CAMERA, "output.smooth=true")
    assert "output.level" in refused(Input.DETECTIONS, "output.smooth=true", "output.level=counts")


@pytest.mark.parametrize("setting", ["source.start_s=1", "source.max_fps=5", "detector.disturbance.preview_s=2"])
def test_a_recording_is_of_the_pictures_that_were_tracked(setting):
    assert "has no effect on a recording of a live run" in refused(Input.RECORDING, setting)
    assert load(assignments=["tracker.coast_s=2", "output.smooth=true"], kind=Input.RECORDING)


def test_a_resolution_cell_is_for_unresolved_targets_or_a_threshold():
    cell, off = "radar.cell_range_m=150", "radar.unresolved=false"
    said = "setting radar.cell_range_m has no effect here; it needs radar.unresolved=true or radar.snr_db=NUMBER"
    assert refused(Input.RADAR, cell, off) == said
    assert load(assignments=[cell], kind=Input.RADAR).radar.cell_range_m == 150
    assert load(assignments=[cell, off, "radar.snr_db=13"], kind=Input.RADAR).radar.cell_range_m == 150


def test_a_file_may_hold_settings_for_other_inputs_but_none_of_its_own_without_effect(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text("[tracker]\ncoast_s = 2.0\n[blobs]\ncut = false\n[radar]\nparticles = 50\n")
    assert load(path, kind=Input.VIDEO).tracker.coast_s == 2
    assert "radar.estimator=particle" in refused(Input.RADAR, file=path)
    path.write_text('[radar]\nestimator = "particle"\nparticles = 50\n[tracker]\ncoast_s = 2.0\n')
    assert load(path, kind=Input.RADAR).radar.particles == 50


def test_file_and_command_line_are_judged_together(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text("[radar]\nparticles = 50\n")
    assert load(path, ["radar.estimator=particle"], kind=Input.RADAR).radar.particles == 50
    path.write_text('[radar]\nestimator = "particle"\nparticles = 50\n')
    said = "setting radar.particles has no effect with radar.estimator=ekf; it needs radar.estimator=particle"
    assert refused(Input.RADAR, "radar.estimator=ekf", file=path) == said
    assert refused(Input.RADAR, "radar.estimator=ekf", "radar.particles=60", file=path) == said


@pytest.mark.parametrize("kind", Input)
def test_what_config_prints_is_accepted_for_every_input(kind, tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text(as_toml(Settings()))
    assert load(path, kind=kind) == Settings()
