"""Slices give the files of a single run."""

import filecmp
import json
from dataclasses import asdict
from fractions import Fraction

import av
import numpy as np
import pyarrow.parquet as pq
import pytest
from command_line import SAMPLES
from synthetic_steps import make_step

from vidtrack.config.load import load
from vidtrack.errors import FormatError
from vidtrack.run.files import run_file
from vidtrack.run.run import Run
from vidtrack.run.slices.cuts import Cut, cuts
from vidtrack.run.slices.kept import About, KeptSteps, read_about
from vidtrack.run.slices.stitch import Slice, stitched_pipeline
from vidtrack.run.slices.stitch import stitched as stitch
from vidtrack.run.slices.track import track_slice
from vidtrack.video.stats import SourceStats

VIDEO = str(SAMPLES / "crossing.avi")
SETTINGS = load(assignments=[("output.lines", ["middle:160,0,160,240"])])


def finish(run):
    with run:
        for _ in run:
            pass


def stitched(folder, found, settings=SETTINGS, video=VIDEO):
    """The run of these slices, in `folder`."""
    parts = [folder / str(one.number) for one in found]
    for one, part in zip(found, parts, strict=True):
        part.mkdir(parents=True)
        before = parts[one.number - 1] if one.goes_on else None
        track_slice(video, settings, one, part, before, lambda: None)
    finish(Run(stitched_pipeline(video, found, parts, settings), folder / "whole"))
    return folder / "whole"


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    folder = tmp_path_factory.mktemp("single")
    finish(run_file(VIDEO, SETTINGS, folder))
    return folder


@pytest.fixture(scope="module")
def halves(tmp_path_factory):
    return stitched(tmp_path_factory.mktemp("halves"), cuts(0.0, None, 10.0, 5.0, 4.0))


def uneven(path):
    """The sample's pictures at uneven times, none from 3.6 to 5.1 s."""
    with av.open(VIDEO) as film:
        pictures = [picture.to_ndarray(format="bgr24") for picture in film.decode(video=0)]
    steps = np.resize([40, 70, 90, 66, 67], len(pictures))
    steps[54] += 1500
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=15)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.codec_context.time_base = "yuv420p", Fraction(1, 1000)
        for stamp, picture in zip(np.cumsum(steps).tolist(), pictures, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, format="bgr24").reformat(format="yuv420p")
            frame.pts, frame.time_base = stamp, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return str(path)


@pytest.mark.parametrize(
    ("video", "max_fps"), [("crossing", None), ("crossing", 7.0), ("junction", 7.0), ("uneven", None), ("uneven", 5.0)]
)
def test_slices_that_go_on_from_each_other_are_the_single_run_bit_by_bit(video, max_fps, tmp_path):
    """The second begins in the middle of a crossing; the last one may lie beyond the end of the file."""
    settings = load(assignments=[("source.max_fps", max_fps)], base=SETTINGS.model_dump())
    path = uneven(tmp_path / "uneven.mkv") if video == "uneven" else str(SAMPLES / f"{video}.avi")
    single = tmp_path / "single"
    finish(run_file(path, settings, single))
    whole = stitched(tmp_path, cuts(0.0, None, 12.0, 4.0, None), settings, path)
    files = {path.name for path in single.iterdir()} - {"summary.json", "tracks.parquet"}
    assert {path.name for path in whole.iterdir()} == {path.name for path in single.iterdir()}
    assert set(filecmp.cmpfiles(single, whole, files, shallow=False)[0]) == files
    assert pq.read_table(whole / "tracks.parquet").equals(pq.read_table(single / "tracks.parquet"))
    told = [json.loads((folder / "summary.json").read_text()) for folder in (single, whole)]
    for once in ("stages", "seconds"):
        assert all(one.pop(once) for one in told)
    assert told[0] == told[1]


def test_two_halves_give_the_same_crossings_and_tracks(single, halves):
    counts = [(folder / "counts.csv").read_text().splitlines() for folder in (single, halves)]
    assert len(counts[0]) > 1
    assert [line.split(",")[1:4] for line in counts[0]] == [line.split(",")[1:4] for line in counts[1]]
    tables = [pq.read_table(folder / "tracks.parquet").to_pydict() for folder in (single, halves)]
    assert len(set(tables[0]["track_id"])) == len(set(tables[1]["track_id"]))
    assert set(zip(tables[1]["frame"], tables[1]["time_s"], strict=True)) <= {
        (frame, round(frame / 15, 6)) for frame in range(150)
    }


def test_a_slice_beyond_the_end_of_the_file_is_empty(single, tmp_path):
    whole = stitched(tmp_path, cuts(0.0, None, 30.0, 15.0, 4.0))
    assert (whole / "tracks.csv").read_bytes() == (single / "tracks.csv").read_bytes()


def test_a_vehicle_that_comes_after_the_seam_takes_no_number_of_another(tmp_path):
    """Left 7 comes after the seam, so it is known only as the later slice's 0; its 1 is new."""
    rows = {0: {7: (12, 40), 3: (0, 8)}, 1: {0: (12, 40), 1: (25, 40)}}
    slices = []
    for number, lives in rows.items():
        folder = tmp_path / str(number)
        folder.mkdir()
        kept = KeptSteps(folder)
        for k in range(40):
            alive = [(i, "c", 4.0 * k, 40.0 * (i % 7)) for i, (a, b) in sorted(lives.items()) if a <= k < b]
            kept.step(make_step(k, alive))
        kept.close()
        kept.about(About(25.0, 320, 240, asdict(SourceStats()), {}))
        slices.append(
            Slice(folder, Cut(number, 0.4 * number, 0.4 if number == 0 else None, 0.4 * number), read_about(folder))
        )
    steps = list(stitch(slices))
    assert [step.index for step in steps] == list(range(40))
    assert all(len(set(step.tracks.id.tolist())) == len(step.tracks) for step in steps)
    assert len({int(i) for step in steps for i in step.tracks.id}) == 3


def test_a_damaged_slice_says_so(tmp_path):
    (tmp_path / "slice.json").write_text('{"fps": ')
    with pytest.raises(FormatError, match="damaged"):
        read_about(tmp_path)
