"""Turning counts as Synchro reads them."""

import csv

import made_up_day
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from made_up_day import MOVEMENTS, SITE, write_day

from vidtrack.cli import cli
from vidtrack.errors import Error


def export(*arguments):
    return cli.main(["export", *map(str, arguments)], prog_name="vidtrack", standalone_mode=False)


def volumes(path):
    lines = path.read_text(encoding="ascii").splitlines()
    assert lines[:2] == ["Turning Movement Count", "15 Minute Counts"]
    return list(csv.DictReader(lines[2:]))


TURNS = {  # from: left, through, right; vehicles from the north travel south
    "north": ("SB", "east", "south", "west"),
    "east": ("WB", "south", "west", "north"),
    "south": ("NB", "west", "north", "east"),
    "west": ("EB", "north", "east", "south"),
}


@pytest.mark.parametrize("metres", [True, False])
def test_each_movement_is_in_its_column(tmp_path, capsys, metres):
    counts = np.arange(1, 37).reshape(3, 12)
    day = write_day(tmp_path / "day", counts, coverage=[1, 0, 0.5], legs=MOVEMENTS, metres=metres)
    export(day, "--as", "utdf", "-o", tmp_path / "out")
    assert capsys.readouterr().err == "site site; 1 interval of 3: those that were not watched whole are left out\n"
    (row,) = volumes(tmp_path / "out" / "Volume.csv")
    assert (row["DATE"], row["TIME"], row["INTID"]) == ("06/01/2026", "0600", "1")
    for start, (way, *ends) in TURNS.items():
        for letter, end in zip("LTR", ends, strict=True):
            assert int(row[way + letter]) == counts[0][MOVEMENTS.index((start, end))]
    assert len(row) == 3 + 12


def test_turns_back_have_their_own_column(tmp_path):
    legs = [("north", "south"), ("north", "north")]
    day = write_day(tmp_path / "day", [[4, 2], [0, 0]], legs=legs)
    export(day, "--as", "utdf", "-o", tmp_path / "out", "-q")
    rows = volumes(tmp_path / "out" / "Volume.csv")
    assert [(row["SBT"], row["SBU"], row["NBT"]) for row in rows] == [("4", "2", "0"), ("0", "0", "0")]


def test_names_say_the_way_only_where_they_are_of_the_compass(tmp_path):
    day = write_day(tmp_path / "day", [4], legs=("north", "south"), metres=False)
    text = (day / "site.toml").read_text().replace("north", "Mill")
    (day / "site.toml").write_text(text)
    with pytest.raises(Error, match="which way vehicles from Mill travel") as refused:
        export(write_renamed(day), "--as", "utdf", "-o", tmp_path / "out")
    assert refused.value.exit_code == 2
    assert not (tmp_path / "out").exists()


def write_renamed(day):
    """The same day with trips from Mill."""
    trips = pq.read_table(day / "trips.parquet")
    place = trips.column_names.index("from_leg")
    pq.write_table(trips.set_column(place, "from_leg", pa.array(["Mill"] * len(trips))), day / "trips.parquet")
    return day


def no_measures(tmp_path):
    (tmp_path / "run").mkdir()
    return tmp_path / "run"


def without_time(tmp_path):
    return write_day(tmp_path / "day", [4], utc_of_time_0=None)


def of_another_interval(tmp_path):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(made_up_day, "INTERVAL_S", 300.0)
        return write_day(tmp_path / "day", [4])


@pytest.mark.parametrize(
    ("make", "code", "words"),
    [
        (no_measures, 3, "give a folder that vidtrack measure wrote"),
        (without_time, 2, "utdf needs dates"),
        (of_another_interval, 2, "15-minute counts, these are of 300 s"),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_line(tmp_path, make, code, words):
    with pytest.raises(Error) as refused:
        export(make(tmp_path), "--as", "utdf", "-o", tmp_path / "out")
    assert refused.value.exit_code == code
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_another_site_is_refused(tmp_path):
    day = write_day(tmp_path / "day", [4])
    (tmp_path / "other.toml").write_text(SITE)
    with pytest.raises(Error, match="measure again with another --site"):
        export(day, "--as", "utdf", "--site", tmp_path / "other.toml", "-o", tmp_path / "out")
