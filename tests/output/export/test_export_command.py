"""`vidtrack export`, and what it refuses."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from road_runs import SITE, hide, usual_ways, way, write_run

from vidtrack.cli import cli
from vidtrack.errors import Error
from vidtrack.output.export.registry import FORMATS
from vidtrack.output.tables import VIDEO


def export(*arguments):
    return cli.main(["export", *map(str, arguments)], prog_name="vidtrack", standalone_mode=False)


@pytest.mark.parametrize("name", [name for name, form in FORMATS.items() if not (form.measures or form.radar)])
def test_every_format_is_written_into_the_folder(tmp_path, capsys, name):
    run = write_run(tmp_path, *usual_ways())
    export(run, "--as", name, "-o", tmp_path / "out")
    out, err = capsys.readouterr()
    assert out == f"{tmp_path / 'out'}\n"
    assert err.splitlines()[-1] == "site road; 3 tracks; 142 of 152 rows have a position in metres"
    files = list((tmp_path / "out").iterdir())
    assert files
    assert all(path.stat().st_size and path.suffix != ".new" for path in files)


def test_the_folder_is_named_after_the_run(tmp_path, monkeypatch, capsys):
    run = write_run(tmp_path, *usual_ways())
    monkeypatch.chdir(tmp_path)
    export(run, "--as", "sumo", "-q")
    assert capsys.readouterr().out == "runs/run-sumo\n"


def test_a_site_can_be_given(tmp_path):
    run = write_run(tmp_path, *usual_ways(), site=SITE.replace("epsg = 25832", ""))
    (tmp_path / "other.toml").write_text(SITE)
    export(run, "--as", "geojson", "--site", tmp_path / "other.toml", "-o", tmp_path / "out", "-q")
    assert (tmp_path / "out" / "tracks.geojson").is_file()


def test_metres_of_another_calibration_are_not_exported(tmp_path):
    run = write_run(tmp_path, *usual_ways())
    (run / "site.toml").write_text(SITE.replace("epsg = 25832", ""))
    site, out = tmp_path / "other.toml", tmp_path / "out"
    site.write_text(SITE.replace("[560030, 5800060]", "[560030, 5800070]"))
    with pytest.raises(Error, match="is not the one that") as refused:
        export(run, "--as", "geojson", "--site", site, "-o", out, "-q")
    assert refused.value.exit_code == 2
    site.write_text(SITE.replace("epsg", "camera_height_m = 8.0\nepsg") + "bus = [15, 20]\n")
    export(run, "--as", "geojson", "--site", site, "-o", out, "-q")


def without_metres(folder):
    return write_run(folder, way(1, range(5)), columns=VIDEO)


def of_radar(folder):
    run = write_run(folder, way(1, range(5)))
    rows = way(1, range(5))
    pq.write_table(pa.table({"scan": rows["frame"], "x_m": rows["x_m"], "y_m": rows["y_m"]}), run / "tracks.parquet")
    return run


def without_site(folder):
    run = write_run(folder, way(1, range(5)))
    (folder / "site.toml").unlink()
    return run


def outside(folder):
    return write_run(folder, hide(way(1, range(5)), range(5)))


def without_table(folder):
    run = write_run(folder, way(1, range(5)))
    (run / "tracks.parquet").unlink()
    return run


def with_a_damaged_table(folder):
    run = write_run(folder, way(1, range(5)))
    (run / "tracks.parquet").write_bytes(b"PAR1 and no more")
    return run


def with_a_damaged_summary(folder):
    run = write_run(folder, way(1, range(5)))
    (run / "summary.json").write_text('{"settings": ')
    return run


def out_of_order(folder):
    run = write_run(folder, way(1, range(5)))
    table = pq.read_table(run / "tracks.parquet")
    pq.write_table(table.take(np.arange(5)[::-1]), run / "tracks.parquet")
    return run


def with_frames_out_of_order(folder):
    run = write_run(folder, way(1, range(5)))
    table = pq.read_table(run / "tracks.parquet")
    frames = table["frame"].take(np.arange(5)[::-1])
    pq.write_table(table.set_column(table.column_names.index("frame"), "frame", frames), run / "tracks.parquet")
    return run


def no_run(folder):
    folder.mkdir()
    return folder


@pytest.mark.parametrize(
    ("make", "code", "words"),
    [
        (without_metres, 2, "has no positions in metres; only runs of vidtrack track --site"),
        (of_radar, 2, "is a run of radar plots"),
        (without_site, 2, "give it with --site"),
        (outside, 3, "has no positions in metres: no vehicle was found inside"),
        (without_table, 3, "vidtrack repair"),
        (with_a_damaged_table, 3, "tracks.parquet is damaged"),
        (with_a_damaged_summary, 3, "is damaged"),
        (out_of_order, 3, "not in order of time"),
        (with_frames_out_of_order, 3, "not in order of frame"),
        (no_run, 3, "it has no summary.json"),
    ],
)
def test_what_cannot_be_exported_is_refused_in_one_line(tmp_path, make, code, words):
    run = make(tmp_path / "in")
    with pytest.raises(Error) as refused:
        export(run, "--as", "sumo", "-o", tmp_path / "out", "-q")
    assert refused.value.exit_code == code
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_a_refused_format_leaves_no_folder(tmp_path):
    run = write_run(tmp_path, *usual_ways(), site=SITE.replace("epsg = 25832", ""))
    with pytest.raises(Error, match="needs places on the globe"):
        export(run, "--as", "geojson", "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_run_is_not_written_into_itself(tmp_path):
    run = write_run(tmp_path, *usual_ways())
    before = sorted(path.name for path in run.iterdir())
    with pytest.raises(Error, match="is what is to be read") as refused:
        export(run, "--as", "geoparquet", "-o", tmp_path / "." / "run", "--force")
    assert refused.value.exit_code == 2
    assert sorted(path.name for path in run.iterdir()) == before


def test_a_folder_in_use_stays_as_it_is(tmp_path):
    run = write_run(tmp_path, *usual_ways())
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    with pytest.raises(Error, match="is not empty"):
        export(run, "--as", "sumo", "-o", tmp_path / "out")
    export(run, "--as", "sumo", "-o", tmp_path / "out", "--force", "-q")
    assert (tmp_path / "out" / "mine.txt").read_text() == "mine"
