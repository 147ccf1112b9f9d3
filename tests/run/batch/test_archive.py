"""`vidtrack measure` and `vidtrack report` over all of a batch: a site's day at a time."""

import json
import re

import pyarrow.dataset as ds
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from places import batch_of, do, small_videos

from vidtrack.cli import cli
from vidtrack.errors import ConfigError, StoppedEarly
from vidtrack.run.batch.archive import folder_name, portions
from vidtrack.run.batch.index import DONE, Row, index_bytes

SITE = """
[site]
name = "crossing"
width = 320
height = 240
[gates.west]
line = [[40, 0], [40, 240]]
role = "entry"
[gates.east]
line = [[280, 0], [280, 240]]
role = "exit"
"""


def run(*arguments):
    """What a command prints last."""
    result = CliRunner().invoke(cli, [str(one) for one in arguments], catch_exceptions=False, standalone_mode=False)
    return result.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """A batch of two videos at one site, on two days, and one without a start."""
    folder = small_videos(tmp_path_factory.mktemp("videos"))
    (folder / "site.toml").write_text(SITE)
    (folder / "third.avi").write_bytes((folder / "cam1" / "08-00.avi").read_bytes())
    (folder / "list.csv").write_text(
        "source,start\ncam1/08-00.avi,2026-06-01T08:00:00+02:00\ncam2/08-00.avi,2026-06-02T00:30:00+02:00\nthird.avi,\n"
    )
    (folder / "cam2" / "08-00.avi").write_bytes((folder / "third.avi").read_bytes())
    out = tmp_path_factory.mktemp("out")
    do(batch_of([folder / "list.csv"], out, given=[("output.site", str(folder / "site.toml"))]))
    return out


@pytest.fixture(scope="module")
def measures(archive):
    return archive.joinpath(run("measure", archive, "-q"))


def test_each_day_is_measured_by_itself(archive, measures):
    days = sorted(path.name for path in (measures / "days" / "crossing").iterdir())
    assert days[:2] == ["2026-06-01", "2026-06-02"]
    assert re.fullmatch(r"undated-third-\w{10}", days[2])
    told = [json.loads((measures / "days" / "crossing" / day / "measures.json").read_text()) for day in days]
    assert [one["utc_of_time_0"] for one in told][:2] == ["2026-06-01T08:00:00+02:00", "2026-06-02T00:30:00+02:00"]
    assert all(one["watched_s"] == pytest.approx(2.0) for one in told)


def test_the_tables_are_one_data_set(measures):
    table = ds.dataset(measures / "tables" / "intervals", partitioning="hive").to_table()
    assert set(table["site"].to_pylist()) == {"crossing"}
    assert len(set(table["day"].to_pylist())) == 3
    alone = pq.read_table(measures / "days" / "crossing" / "2026-06-01" / "intervals.parquet")
    assert table.filter(ds.field("day") == "2026-06-01").num_rows == alone.num_rows


def test_a_page_leads_to_the_report_of_each_day(archive, measures):
    folder = archive.joinpath(run("report", archive, "-q"))
    page = (folder / "report.html").read_text()
    links = re.findall(r'href="([^"]+)"', page)
    assert len(links) == 3
    assert all((folder / link).is_file() for link in links)


def test_a_site_can_be_given_later(archive, tmp_path):
    (tmp_path / "moved.toml").write_text(SITE.replace('"crossing"', '"moved"'))
    site = tmp_path / "moved.toml"
    folder = tmp_path / run("measure", archive, "--site", site, "-o", tmp_path / "m", "-q")
    assert [path.name for path in (folder / "days").iterdir()] == ["moved"]
    corrected = folder / "days" / "moved" / "2026-06-01" / "corrections.csv"
    corrected.write_text("verdict,time_s,gate,direction,run,track_id\n")
    site.write_text(SITE.replace('"crossing"', '"again"'))
    run("measure", archive, "--site", site, "-o", folder, "--force", "-q")
    assert [path.parent.parent.name for path in folder.glob("days/*/*/measures.json")] == ["again"] * 3
    assert [path.name for path in folder.glob("days/moved/*/*")] == ["corrections.csv"]
    table = ds.dataset(folder / "tables" / "intervals", partitioning="hive").to_table()
    assert set(table["site"].to_pylist()) == {"again"}


def test_two_sites_do_not_share_a_folder(tmp_path):
    rows = []
    for folder, name in (("one", "A_N"), ("two", "A N")):
        (tmp_path / "results" / folder).mkdir(parents=True)
        (tmp_path / "results" / folder / "site.toml").write_text(SITE.replace('"crossing"', f'"{name}"'))
        rows.append(Row(f"/{folder}.avi", folder, site=f"/{folder}.toml", state=DONE))
    (tmp_path / "index.parquet").write_bytes(index_bytes(rows))
    with pytest.raises(ConfigError, match="A N and A_N would have one folder, A_N"):
        portions(str(tmp_path), None)


@pytest.mark.parametrize(
    ("name", "folder"), [("..", "site"), ("../x", "_x"), (".hidden", "hidden"), ("Süd 1", "Süd_1")]
)
def test_a_site_gets_a_folder_below_the_measures(name, folder):
    assert folder_name(name) == folder


def test_a_day_that_cannot_be_measured_does_not_end_the_others(archive, tmp_path):
    damaged = next(archive.glob("results/08-00-*/summary.json"))
    whole = damaged.read_text()
    damaged.write_text("{")
    try:
        with pytest.raises(StoppedEarly, match="1 of 3 days"):
            run("measure", archive, "-o", tmp_path / "m", "-q")
        assert len(list((tmp_path / "m").glob("days/crossing/*"))) == 2
    finally:
        damaged.write_text(whole)
