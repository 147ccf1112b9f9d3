"""A result with rows in every Nth frame only, as `--max-fps` leaves it."""

import json

import pytest

TRUTH = [(frame, track, 40 * track + frame, 50) for frame in range(60) for track in (1, 2)]


def write(path, rows):
    path.write_text("".join(f"{frame + 1},{track},{left},{top},30,20,1,-1,-1,-1\n" for frame, track, left, top in rows))
    return path


@pytest.fixture
def files(tmp_path):
    """A result that is right in every third frame, and the truth."""
    thinned = [row for row in TRUTH if row[0] % 3 == 0]
    return write(tmp_path / "thinned.txt", thinned), write(tmp_path / "gt.txt", TRUTH)


def test_the_frames_between_count_as_missed_and_a_warning_says_so(vidtrack, files):
    code, out, err = vidtrack("eval", *files, "--json", "-")
    assert code == 0
    assert json.loads(out)["misses"] == 80
    assert "one frame of 3" in err
    assert "80 rows" in err
    assert "--every 3" in err


def test_every_nth_frame_is_scored_alone(vidtrack, files):
    code, out, err = vidtrack("eval", *files, "--every", "3", "--json", "-")
    scores = json.loads(out)
    assert (code, err) == (0, "")
    assert (scores["mota"], scores["misses"], scores["truth_rows"], scores["frames"]) == (1, 0, 40, 20)


def test_a_result_in_all_frames_is_not_warned_of(vidtrack, files):
    assert vidtrack("eval", files[1], files[1], "--json", "-")[::2] == (0, "")


@pytest.mark.parametrize("every", ["0", "-1", "x"])
def test_a_number_that_is_none_is_refused(vidtrack, files, every):
    code, _, err = vidtrack("eval", *files, "--every", every)
    assert code == 2
    assert "--every" in err
