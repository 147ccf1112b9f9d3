"""A radar run as ASTERIX CAT 062, read back by libasterix."""

import json
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest
from asterix_records import layout
from click.testing import CliRunner

from vidtrack.cli.export import command
from vidtrack.config.settings import Settings
from vidtrack.errors import FormatError
from vidtrack.output.export.radar_run import open_radar_run
from vidtrack.radar.plane import Plane
from vidtrack.run.fuse import read_tracks
from vidtrack.run.radar import run_plots
from vidtrack.simulate.radar_scenarios import simulate_radar
from vidtrack.simulate.radar_write import write_radar

PLACE = (52.36, 13.51, 48.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tws")
    write_radar(simulate_radar("radar-crossing", 1), folder)
    settings = Settings().model_copy(update={"radar": Settings().radar.model_copy(update={"sac": 25, "sic": 201})})
    with run_plots(str(folder / "plots.csv"), settings, folder / "run") as result:
        for _ in result:
            pass
    return folder / "run"


def exported(run, tmp_path, *options):
    done = CliRunner().invoke(command, [str(run), "--as", "asterix", "-o", str(tmp_path / "out"), *options])
    assert done.exit_code == 0, done.output
    from asterix.base import Bits, RawDatablock

    blocks = RawDatablock.parse(Bits.from_bytes((tmp_path / "out" / "tracks.ast").read_bytes()))
    assert all(block.get_category() == 62 for block in blocks)
    assert max(len(block.unparse()) // 8 for block in blocks) <= 1400
    return [record for block in blocks for record in layout("Cat_062_1_20").cv_uap.parse(block.get_raw_records())]


def value(record, item, part=None, unit=None):
    found = record.get_item(item).variation
    found = found if part is None else found.get_item(part).variation
    return found.content.as_quantity(unit) if unit else found.content.as_uint()


def test_the_library_reads_every_row_to_within_its_last_bit(run, tmp_path):
    records = exported(run, tmp_path, "--radar-position", "52.36,13.51,48")
    table = pq.read_table(run / "tracks.parquet").to_pydict()
    assert len(records) == len(table["scan"])
    assert [value(one, "040") for one in records] == table["track_id"]
    for item, part, unit, column, step in (
        ("070", None, "s", "time_s", 1 / 128),
        ("100", "X", "m", "x_m", 0.5),
        ("100", "Y", "m", "y_m", 0.5),
        ("185", "VX", "m/s", "vx_m_s", 0.25),
        ("185", "VY", "m/s", "vy_m_s", 0.25),
    ):
        read = [value(one, item, part, unit) for one in records]
        np.testing.assert_allclose(read, table[column], atol=step / 2 + 1e-9)
    latitude = np.array([value(one, "105", "LAT", "°") for one in records])
    longitude = np.array([value(one, "105", "LON", "°") for one in records])
    xy = Plane(*PLACE).metres(latitude, longitude)
    np.testing.assert_allclose(xy, np.column_stack([table["x_m"], table["y_m"]]), atol=0.4)


def test_errors_and_states_are_those_of_the_run(run, tmp_path):
    records = exported(run, tmp_path)
    table = pq.read_table(run / "tracks.parquet").to_pydict()
    for k, one in enumerate(records):
        accuracy = one.get_item("500").variation.get_item("APC").variation
        for part, column in (("X", "sigma_x_m"), ("Y", "sigma_y_m")):
            sigma = accuracy.get_item(part).variation.content.as_quantity("m")
            assert sigma == pytest.approx(table[column][k], abs=0.26)
        status = one.get_item("080").variation
        assert status.get_item("CST").as_uint() == (table["status"][k] == "coasting")
        assert status.get_item("CNF").as_uint() == (table["status"][k] == "tentative")
        assert status.get_item("MON").as_uint() == 1
    firsts = sum(one.get_item("080").variation.get_item("TSB").as_uint() for one in records)
    assert firsts == len(set(table["track_id"]))
    assert all(value(one, "010", "SIC") == 201 for one in records)


def test_without_a_position_there_are_metres_only_and_a_word_about_it(run, tmp_path):
    records = exported(run, tmp_path)
    assert all(one.get_item("105") is None for one in records)
    done = CliRunner().invoke(command, [str(run), "--as", "asterix", "-o", str(tmp_path / "again")])
    assert "in metres only: --radar-position gives positions in WGS84" in done.output


def test_the_run_knows_its_position(run, tmp_path):
    summary = json.loads((run / "summary.json").read_text())
    copy = tmp_path / "run"
    copy.mkdir()
    (copy / "summary.json").write_text(json.dumps(summary | {"origin": PLACE}))
    (copy / "tracks.parquet").write_bytes((run / "tracks.parquet").read_bytes())
    assert exported(copy, tmp_path)[0].get_item("105") is not None


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--as", "asterix", "--radar-position", "52.36"], "is not LAT,LON or LAT,LON,HEIGHT"),
        (["--as", "asterix", "--radar-position", "152,13"], "a latitude is in -90..90"),
        (["--as", "asterix", "--site", "site.toml"], "is for radar runs, which have no site"),
        (["--as", "geojson", "--radar-position", "52,13"], "--radar-position is for asterix"),
    ],
)
def test_options_without_sense_are_refused(run, options, said):
    done = CliRunner().invoke(command, [str(run), *options])
    assert done.exit_code
    assert said in f"{done.output}{done.exception}"


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    done = CliRunner().invoke(command, [str(tmp_path), "--as", "asterix"])
    assert "is not a finished run" in str(done.exception)


def test_a_table_that_is_damaged_within_is_named_with_what_to_do(run, tmp_path):
    shutil.copytree(run, tmp_path / "run")
    table = tmp_path / "run" / "tracks.parquet"
    content = table.read_bytes()
    table.write_bytes(content[:4] + bytes(200) + content[204:])
    with pytest.raises(FormatError, match=r"tracks\.parquet is damaged: .*; vidtrack repair .* makes it from"):
        list(open_radar_run(tmp_path / "run").tables())
    with pytest.raises(FormatError, match=r"tracks\.parquet is damaged"):
        read_tracks(tmp_path / "run")
