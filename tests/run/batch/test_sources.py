"""What SOURCES means, and what is refused."""

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.run.batch.remote import is_remote, without_secrets
from vidtrack.run.batch.sources import listed


@pytest.fixture
def archive(tmp_path):
    for name in ("a/1.mp4", "a/deep/2.AVI", "a/notes.doc", "a/.3.mp4", "b/1.mp4"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "0.png").write_bytes(b"x")
    (tmp_path / "empty").mkdir()
    return tmp_path


def addresses(*given):
    return [source.address for source in listed([str(one) for one in given])]


def test_folders_files_and_patterns(archive):
    a = [str(archive / "a" / "1.mp4"), str(archive / "a" / "deep" / "2.AVI")]
    assert addresses(archive / "a") == a
    assert addresses(f"file://{archive}/a") == a
    assert addresses(archive / "*" / "1.mp4") == [a[0], str(archive / "b" / "1.mp4")]
    assert addresses(archive / "a" / "1.mp4") == a[:1]
    assert addresses(archive / "pictures") == [str(archive / "pictures")]


def test_equal_names_from_two_places_get_two_folders(archive):
    one, other = listed([str(archive / "a" / "1.mp4"), str(archive / "b" / "1.mp4")])
    assert one.name != other.name
    assert one.name.startswith("1-")


def test_a_table_says_more_of_each_source(archive):
    table = archive / "list.csv"
    table.write_text(
        "source,start,site,settings\n"
        "a/1.mp4,2026-06-01T07:00:00+02:00,site.toml,tracker.coast_s=2; detector.kind=mog2\n"
        "b/1.mp4,,,\n"
    )
    one, other = listed([str(table)])
    assert one.address == str(archive / "a" / "1.mp4")
    assert one.start.isoformat() == "2026-06-01T07:00:00+02:00"
    assert one.site == str(archive / "site.toml")
    assert one.settings == ("tracker.coast_s=2", "detector.kind=mog2")
    assert (other.start, other.site, other.settings) == (None, None, ())
    pq.write_table(pa.table({"source": ["b/1.mp4"]}), archive / "list.parquet")
    assert addresses(archive / "list.parquet") == [other.address]


@pytest.mark.parametrize(
    ("content", "error", "message"),
    [
        ("file\na.mp4\n", FormatError, "no column source"),
        ("source,sight\na.mp4,s.toml\n", FormatError, "did you mean site"),
        ("source,start\na.mp4,monday\n", FormatError, "'monday' is no time"),
        ("source,start\na.mp4,2026-06-01T07:00:00\n", FormatError, "has no zone"),
        ("source,site\n,s.toml\n", FormatError, "row 1 .* names no source"),
        ("source\n", SourceError, "there is no source"),
        ("source\na.mp4\na.mp4\n", ConfigError, "listed twice"),
    ],
)
def test_a_bad_table_is_one_line(tmp_path, content, error, message):
    (tmp_path / "list.csv").write_text(content)
    with pytest.raises(error, match=message) as refused:
        listed([str(tmp_path / "list.csv")])
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        (["none.mp4"], SourceError, "no such file"),
        (["none.csv"], SourceError, "cannot open"),
        (["none/*.mp4"], SourceError, "nothing matches"),
        (["empty"], SourceError, "no video and no images"),
        (["a/1.mp4", "a"], ConfigError, "listed twice"),
    ],
)
def test_bad_sources_are_one_line(archive, monkeypatch, given, error, message):
    monkeypatch.chdir(archive)
    with pytest.raises(error, match=message):
        listed(given)


def test_addresses_show_no_secrets():
    assert is_remote("s3://bucket/a.mp4")
    assert not is_remote("file:///a.mp4")
    assert without_secrets("ftp://me:secret@host/a.mp4") == "ftp://***@host/a.mp4"
    assert without_secrets("https://host/a.mp4?token=abc") == "https://host/a.mp4?token=***"
