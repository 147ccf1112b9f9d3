"""The files that `vidtrack simulate` writes."""

import av
import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack import formats
from vidtrack.cli.simulate import command
from vidtrack.errors import OutputError
from vidtrack.simulate import simulate, write


def decoded(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return stream.average_rate, [frame.to_ndarray(format="bgr24") for frame in container.decode(stream)]


@pytest.mark.parametrize(("fps", "size"), [(None, None), (30000 / 1001, (161, 121)), (123.456789, (64, 48))])
def test_the_video_has_every_frame_at_the_right_rate_and_looks_like_the_clip(tmp_path, fps, size):
    clip = simulate("crossing", seed=2, fps=fps, size=size)
    write(clip, tmp_path)
    rate, frames = decoded(tmp_path / "video.avi")
    assert float(rate) == pytest.approx(clip.fps, rel=1e-5)
    assert len(frames) == len(clip)
    assert np.abs(frames[50].astype(float) - clip.frame(50)).mean() < 8


def test_the_truth_file_is_mot_with_visibility_in_column_nine(tmp_path):
    clip = simulate("junction", seed=2)
    write(clip, tmp_path)
    table = formats.read(tmp_path / "gt.txt")
    assert np.array_equal(table.frame, clip.truth.frame)
    assert np.array_equal(table.id, clip.truth.id)
    assert table.box == pytest.approx(clip.truth.box, abs=1e-3)
    columns = np.loadtxt(tmp_path / "gt.txt", delimiter=",")
    assert columns.shape[1] == 9
    assert columns[:, 0].min() == 1
    assert (columns[:, 6:8] == 1).all()
    assert columns[:, 8] == pytest.approx(clip.truth.visibility, abs=1e-3)


def test_the_command_writes_exactly_two_files(tmp_path):
    folder = tmp_path / "new" / "folder"
    result = CliRunner().invoke(command, ["crossing", "-o", str(folder), "--size", "160x120", "--seed", "9"])
    assert result.exit_code == 0, result.output
    assert result.stdout == ""
    assert sorted(path.name for path in folder.iterdir()) == ["gt.txt", "video.avi"]


def test_the_command_refuses_a_folder_that_is_not_empty_without_force(tmp_path):
    (tmp_path / "mine.txt").write_text("keep me")
    arguments = ["crossing", "-o", str(tmp_path), "--size", "64x48", "--quiet"]
    refused = CliRunner().invoke(command, arguments)
    assert isinstance(refused.exception, OutputError)
    assert not (tmp_path / "gt.txt").exists()
    assert CliRunner().invoke(command, [*arguments, "--force"]).exit_code == 0
    assert (tmp_path / "mine.txt").read_text() == "keep me"
    assert (tmp_path / "gt.txt").exists()


@pytest.mark.parametrize("size", ["big", "12", "3x", "x4"])
def test_a_size_that_is_not_one_is_named(size):
    result = CliRunner().invoke(command, ["crossing", "-o", "unused", "--size", size])
    assert result.exit_code == 2
    assert size in result.output
