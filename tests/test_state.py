"""A saved pipeline goes on as if it had not stopped."""

import numpy as np
import pytest
from command_line import SAMPLES

from vidtrack.config.load import load
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError, FormatError
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, video_steps
from vidtrack.scan import Scan
from vidtrack.state import gather, read_state, restore, write_state
from vidtrack.tracking.register import Register
from vidtrack.video.source import open_source

HALF_S = 4.0


class Pipeline:
    STATE = ("detector", "tracker")

    def __init__(self, settings):
        self.settings = settings
        self.detector = build_detector(settings)
        self.tracker = build_blob_tracker(settings.tracker, (320, 240))

    def steps(self, frames):
        return list(video_steps(frames, self.detector, self.tracker, self.settings))


@pytest.fixture(scope="module")
def frames():
    with open_source(str(SAMPLES / "crossing.avi"), Settings().source) as source:
        return list(source)


def halves(frames):
    return [f for f in frames if f.time_s < HALF_S], [f for f in frames if f.time_s >= HALF_S]


@pytest.mark.parametrize(
    "setting",
    ["detector.kind=disturbance", "detector.kind=paper"]
    + [f"tracker.method={method}" for method in ("nn", "generalized-nn", "psn", "pda", "jpda-star", "split", "mht")],
)
def test_it_goes_on_bit_by_bit(tmp_path, frames, setting):
    settings = load(assignments=[setting])
    first, second = halves(frames)
    stopped, resumed = Pipeline(settings), Pipeline(settings)
    stopped.steps(first)
    write_state(tmp_path / "state", gather(stopped))
    expected = stopped.steps(second)
    restore(resumed, read_state(tmp_path / "state"))
    for a, b in zip(expected, resumed.steps(second), strict=True):
        assert np.array_equal(a.tracks.x, b.tracks.x)
        assert np.array_equal(a.tracks.P, b.tracks.P)
        assert np.array_equal(a.tracks.id, b.tracks.id)
        assert np.array_equal(a.foreground.mask, b.foreground.mask)
    assert max(len(step.tracks) for step in expected) > 1


def test_what_is_gathered_is_a_copy(frames):
    first, second = halves(frames)
    pipeline = Pipeline(Settings())
    pipeline.steps(first)
    state = gather(pipeline)
    before = {name: value.copy() for name, value in state.items() if isinstance(value, np.ndarray)}
    pipeline.steps(second)
    assert all(np.array_equal(state[name], value, equal_nan=True) for name, value in before.items())


def test_a_state_before_the_first_frame_is_one_too(tmp_path, frames):
    write_state(tmp_path / "state", gather(Pipeline(Settings())))
    resumed = Pipeline(Settings())
    restore(resumed, read_state(tmp_path / "state"))
    assert len(resumed.steps(frames[:5])) == 5


def test_other_settings_do_not_fit(frames):
    paper, ours = Pipeline(load(assignments=["detector.kind=paper"])), Pipeline(Settings())
    for pipeline in (paper, ours):
        pipeline.steps(frames[:3])
    with pytest.raises(FormatError, match="other settings"):
        restore(ours, gather(paper))


@pytest.mark.parametrize(
    ("saved", "now"),
    [
        ("tracker.method=mht", "tracker.method=gnn"),
        ("tracker.method=gnn", "tracker.method=mht"),
        ("tracker.method=split", "tracker.method=mht"),
        ("tracker.merged_blobs=false", "tracker.merged_blobs=true"),
        ("tracker.merged_blobs=true", "tracker.merged_blobs=false"),
    ],
)
def test_a_state_of_other_policies_is_refused(frames, saved, now):
    old, new = (Pipeline(load(assignments=[setting])) for setting in (saved, now))
    old.steps(frames[:20])
    with pytest.raises(FormatError, match="other settings"):
        restore(new, gather(old))


def test_a_state_of_an_earlier_version_is_refused_in_one_line(frames):
    """Before decisions and pictures were parts of their own, these were the tracker's names."""
    pipeline = Pipeline(Settings())
    pipeline.steps(frames[:20])
    old = {name.replace("picture.road", "road"): value for name, value in gather(pipeline).items()}
    with pytest.raises(FormatError, match="another version made it") as refused:
        restore(Pipeline(Settings()), old | {"tracker.forest": None})
    assert "\n" not in str(refused.value)


def test_a_state_of_the_last_version_goes_on_after_an_update(frames):
    """Which tracks came in over the border, and which began beside a vehicle, was not known then."""
    first, second = halves(frames)
    stopped, resumed = Pipeline(Settings()), Pipeline(Settings())
    stopped.steps(first)
    added = tuple(f"register.{name}" for name in Register.ADDED)
    old = {name: value for name, value in gather(stopped).items() if not name.endswith(added)}
    assert len(gather(stopped)) - len(old) == len(added)
    restore(resumed, old)
    assert len(resumed.tracker.register.entered) == len(resumed.tracker.register) > 0
    for a, b in zip(stopped.steps(second), resumed.steps(second), strict=True):
        assert np.array_equal(a.tracks.id, b.tracks.id)


def test_arrays_of_another_kind_do_not_reach_compiled_code(frames):
    pipeline = Pipeline(Settings())
    pipeline.steps(frames[:20])
    for wrong in (np.zeros((2, 6)), np.zeros((2, 4), np.float32), np.zeros(4), None):
        with pytest.raises(FormatError, match=r"tracker\.bank\.x"):
            restore(Pipeline(Settings()), gather(pipeline) | {"tracker.bank.x": wrong})


def test_what_cannot_be_saved_says_so():
    with pytest.raises(ConfigError, match="OpenCV"):
        gather(Pipeline(load(assignments=["detector.kind=mog2"])))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 half a file", b"{}"])
def test_a_damaged_file_says_so(tmp_path, content):
    (tmp_path / "state").write_bytes(content)
    with pytest.raises(FormatError, match="state"):
        read_state(tmp_path / "state")


def test_no_file_is_unpickled(tmp_path):
    np.savez(tmp_path / "state.npz", plain=np.array([{"a": 1}], dtype=object))
    with pytest.raises(FormatError):
        read_state(tmp_path / "state.npz")


def test_a_failed_write_leaves_the_old_state(tmp_path, monkeypatch):
    path = tmp_path / "state"
    write_state(path, {"a": 1})

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_state(path, {"a": 2})
    assert read_state(path) == {"a": 1}


def test_errors_that_last_are_told_from_new_ones_after_a_pause_too():
    def scan(k):
        box = np.array([[20.0 + 3 * k, 40.0, 24.0, 16.0]])
        z = box[:, :2] + box[:, 2:] / 2
        cov = np.eye(2)[None]
        return Scan(k / 25, z, 4 * cov, lasting=3 * cov, box=np.column_stack([box[:, :2] - z, box[:, 2:]]))

    one = build_blob_tracker(Settings().tracker, (320, 240))
    for k in range(20):
        one.step(scan(k))
    other = build_blob_tracker(Settings().tracker, (320, 240))
    restore(other, gather(one))
    assert np.array_equal(one.step(scan(20)).P, other.step(scan(20)).P)
