"""Tables in files: what is read, and what is said about files that cannot be."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from vidtrack import formats
from vidtrack.errors import FormatError, SourceError

TRACKS = """frame,time_s,track_id,status,x_px,y_px,sigma_x_px,sigma_y_px,corr_xy,left_px,top_px,width_px,height_px,nis
0,0.00,3,confirmed,11,22,2,3,0.5,1,2,20,40,1.5
1,0.04,3,coasting,12,22,2,3,0.5,2,2,20,40,
"""


def written(folder, text, name="file.txt"):
    path = folder / name
    path.write_text(text)
    return path


def test_mot_frames_count_from_one_and_tables_from_zero(tmp_path):
    table = formats.read(written(tmp_path, "1,7,10,20,30,40,0.5,-1,-1,-1\n3,7,11,20,30,40\n"))
    assert table.frame.tolist() == [0, 2]
    assert table.id.tolist() == [7, 7]
    assert table.box.tolist() == [[10, 20, 30, 40], [11, 20, 30, 40]]
    assert table.xy.tolist() == [[25, 40], [26, 40]]
    assert table.conf.tolist() == [0.5, 1]


def test_mot_with_blanks_exponents_and_empty_lines(tmp_path):
    table = formats.read(written(tmp_path, "1.0e+00 -1 1 2 3 4 0.9\n\n 2, -1, 1, 2, 3, 4, 0.9\n"))
    assert table.frame.tolist() == [0, 1]


def test_detections_may_repeat_in_a_frame(tmp_path):
    assert len(formats.read(written(tmp_path, "1,-1,1,2,3,4,1\n1,-1,1,2,3,4,1\n"))) == 2


def test_an_empty_mot_file_has_no_rows(tmp_path):
    table = formats.read(written(tmp_path, ""))
    assert len(table) == 0
    assert table.box.shape == (0, 4)


def test_mot_round_trip(tmp_path):
    rng = np.random.default_rng(0)
    table = formats.box_table(np.arange(5), np.arange(5) + 1, rng.uniform(0, 100, (5, 4)).round(3))
    formats.write_mot(tmp_path / "mot.txt", table)
    again = formats.read(tmp_path / "mot.txt")
    np.testing.assert_array_equal(again.box, table.box)
    np.testing.assert_array_equal(again.frame, table.frame)


def test_positions_cannot_be_written_as_mot(tmp_path):
    table = formats.Table(np.zeros(1, int), np.ones(1, int), np.zeros((1, 2)), None, np.ones(1))
    with pytest.raises(FormatError, match="no boxes"):
        formats.write_mot(tmp_path / "mot.txt", table)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("2,1,10,20,x,40,1", "could not convert string to float: 'x'"),
        ("2,1,10", "is not frame,id,left"),
        ("2,1,nan,20,30,40,1", "not finite"),
        ("2,1,10,20,inf,40,1", "not finite"),
        ("0,1,10,20,30,40,1", "frame is 0; MOT frames count from 1"),
        ("1.5,1,10,20,30,40,1", "frame is 1.5; must be a whole number"),
        ("2,1.5,10,20,30,40,1", "id is 1.5"),
        ("2,1,10,20,-30,40,1", "neither may be negative"),
        ("1,1,10,20,30,40,1", "id 1 stands twice in a frame, first at .*line 1"),
    ],
)
def test_a_bad_mot_line_is_named(tmp_path, line, message):
    path = written(tmp_path, f"1,1,10,20,30,40,1\n\n{line}\n")
    with pytest.raises(FormatError, match=rf"line 3: .*{message}"):
        formats.read(path)


def test_tracks_csv(tmp_path):
    table = formats.read(written(tmp_path, TRACKS, "tracks.csv"))
    assert table.frame.tolist() == [0, 1]
    assert table.xy.tolist() == [[11, 22], [12, 22]]
    assert table.box[1].tolist() == [2, 2, 20, 40]
    assert table.cov[0].tolist() == [[4, 3], [3, 9]]
    assert table.nis[0] == 1.5
    assert np.isnan(table.nis[1])
    assert table.unit == "px"


def test_parquet_equals_csv(tmp_path):
    csv = formats.read(written(tmp_path, TRACKS, "tracks.csv"))
    columns = pa.csv.read_csv(tmp_path / "tracks.csv")
    pa.parquet.write_table(columns, tmp_path / "tracks.parquet")
    parquet = formats.read(tmp_path / "tracks.parquet")
    for name in ("frame", "id", "xy", "box", "cov", "nis"):
        np.testing.assert_array_equal(getattr(parquet, name), getattr(csv, name))


def test_radar_truth_is_in_metres(tmp_path):
    text = "scan,time_s,target_id,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s\n0,0,1,100,200,300,1,2,3\n"
    table = formats.read(written(tmp_path, text, "truth.csv"))
    assert table.xy.tolist() == [[100, 200, 300]]
    assert (table.unit, table.box, table.cov) == ("m", None, None)


def test_boxes_alone_give_their_centres(tmp_path):
    table = formats.read(
        written(tmp_path, "frame,track_id,left_px,top_px,width_px,height_px\n0,1,10,20,30,40\n", "a.csv")
    )
    assert table.xy.tolist() == [[25, 40]]


def test_boxes_that_are_all_empty_are_none(tmp_path):
    text = "frame,track_id,x_px,y_px,left_px,top_px,width_px,height_px\n0,1,10,20,,,,\n"
    assert formats.read(written(tmp_path, text, "a.csv")).box is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("track_id", "trackid", "no column track_id or target_id: nearest is 'trackid'"),
        ("frame,", "frme,", "no column frame or scan: nearest is 'frme'"),
        ("12,22", "12,abc", "line 3.*'abc'"),
        ("12,22", "12,", "line 3: x_px, y_px .*must be finite"),
        ("12,22", "12", "line 3.*Expected 14 columns"),
        ("1,0.04", "-1,0.04", "line 3: frame is -1"),
        ("1,0.04", "0,0.04", "line 3: id 3 stands twice"),
        ("0.04,3", "0.04,", "line 3: track_id is nan"),
    ],
)
def test_a_bad_csv_is_explained(tmp_path, old, new, message):
    path = written(tmp_path, TRACKS.replace(old, new), "tracks.csv")
    with pytest.raises(FormatError, match=message):
        formats.read(path)


def test_a_table_without_positions_names_the_nearest(tmp_path):
    with pytest.raises(FormatError, match=r"no positions: nearest .*'x_pix'"):
        formats.read(written(tmp_path, "frame,track_id,x_pix\n0,1,2\n", "a.csv"))


def test_an_empty_csv_and_a_broken_parquet_are_errors(tmp_path):
    with pytest.raises(FormatError, match="Empty CSV"):
        formats.read(written(tmp_path, "", "tracks.csv"))
    with pytest.raises(FormatError, match="not a readable Parquet"):
        formats.read(written(tmp_path, "PAR1 and no more", "tracks.parquet"))


def test_arbitrary_bytes_are_a_format_error(tmp_path):
    path = tmp_path / "noise.txt"
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    with pytest.raises(FormatError, match=r"noise\.txt"):
        formats.read(path)


def test_a_run_folder_gives_boxes_and_states(tmp_path):
    written(tmp_path, "1,3,100,2,20,40,1,-1,-1,-1\n", "mot.txt")
    written(tmp_path, TRACKS, "tracks.csv")
    assert formats.read(tmp_path).box.tolist() == [[100, 2, 20, 40]]
    assert formats.read_states(tmp_path).nis[0] == 1.5


def test_what_is_not_there_is_a_source_error(tmp_path):
    with pytest.raises(SourceError, match="no such file"):
        formats.read(tmp_path / "nothing.txt")
    with pytest.raises(SourceError, match=r"holds no mot\.txt or tracks"):
        formats.read(tmp_path)


def test_a_run_without_tracks_can_be_scored_by_its_boxes(tmp_path):
    written(tmp_path, TRACKS.splitlines()[0] + "\n", "tracks.csv")
    assert formats.read(tmp_path).box.shape == (0, 4)
