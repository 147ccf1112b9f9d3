"""Speeds, classes and the scale in the figures, from edges that were seen."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from drawn_runs import CALIBRATED, site, straight, write_run

from vidtrack.traffic.measures.measure import measured

CAR_PX = (43.0, 17.5)


def run_with_edges(folder, tracks, size=CAR_PX):
    """A finished run from straight above, 10 px/m, whose rows have a speed that is wrong and edges that are right."""
    write_run(folder, tracks, metres=True)
    table = pq.read_table(folder / "tracks.parquet")
    x, y = table["x_px"].to_numpy(), table["y_px"].to_numpy()
    (wide, high), column = size, table.column_names.index("speed_kmh")
    table = table.set_column(column, "speed_kmh", pa.array(0.8 * table["speed_kmh"].to_numpy()))
    edges = {"left": x - wide / 2, "top": y - high / 2, "right": x + wide / 2, "bottom": y + high / 2}
    for side, values in edges.items():
        table = table.append_column(f"seen_{side}_px", pa.array(values))
    pq.write_table(table, folder / "tracks.parquet")
    return [str(folder)]


def test_crossings_have_the_speed_size_and_class_of_the_whole_track(tmp_path):
    runs = run_with_edges(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)])
    rows = measured(runs, site(CALIBRATED)).tables["crossings"].to_pylist()
    assert [row["gate"] for row in rows] == ["west", "middle", "east"]
    for row in rows:
        assert row["speed_kmh"] == pytest.approx(43.2, rel=0.005)
        assert 0 < row["speed_sigma_kmh"] < 1.0
        assert row["length_m"] == pytest.approx(4.3, abs=0.3)
        assert row["class"] == "car"
        assert row["class_probability"] > 0.8


def test_a_site_s_own_classes_are_by_length(tmp_path):
    runs = run_with_edges(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)])
    own = site(CALIBRATED, classes={"short": (0.0, 3.0), "middling": (3.0, 6.0)})
    rows = measured(runs, own).tables["crossings"].to_pylist()
    assert {row["class"] for row in rows} == {"middling"}
    assert min(row["class_probability"] for row in rows) > 0.9


def test_classes_that_a_length_does_not_decide_are_unknown(tmp_path):
    runs = run_with_edges(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)])
    length = measured(runs, site(CALIBRATED)).tables["crossings"]["length_m"][0].as_py()
    close = site(CALIBRATED, classes={"short": (2.0, length + 0.01), "long": (length + 0.01, 9.0)})
    beyond = site(CALIBRATED, classes={"long": (9.0, 12.0)})
    for one in (close, beyond):
        assert set(measured(runs, one).tables["crossings"]["class"].to_pylist()) == {"unknown"}


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_report_says_when_vehicles_come_out_too_large(tmp_path, factor):
    tracks = [straight(track, 3.0 * track, 20, 200 + 5 * track, 120.0, 4.0) for track in range(1, 15)]
    runs = run_with_edges(tmp_path / "run", tracks, tuple(factor * side for side in CAR_PX))
    scale = measured(runs, site(CALIBRATED)).report["scale"]
    assert scale["vehicles"] == 14
    assert scale["factor"] == pytest.approx(factor, rel=0.12)
    assert scale["off"] == (factor != 1.0)


def test_runs_of_earlier_versions_have_the_speeds_of_their_rows(tmp_path):
    write_run(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)], metres=True)
    found = measured([str(tmp_path / "run")], site(CALIBRATED))
    assert found.report["scale"] is None
    assert np.allclose(found.tables["crossings"]["speed_kmh"].to_numpy(), 43.2)
    assert found.tables["crossings"]["class"].to_pylist() == [None] * 3


@pytest.mark.parametrize(
    ("bounds", "name", "low", "high"),
    [((3.0, 6.0), "short", 0.99, 1.0), ((3.9, 6.0), "unknown", 0.6, 0.75), ((5.0, 6.0), "unknown", np.nan, np.nan)],
)
def test_without_a_fit_the_lengths_of_rows_tell_a_site_s_class_and_how_likely_it_is(tmp_path, bounds, name, low, high):
    """Lengths of 4 m, known to 0.2 m, however many rows have them."""
    write_run(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)], metres=True)
    crossings = measured([str(tmp_path / "run")], site(CALIBRATED, classes={"short": bounds})).tables["crossings"]
    assert set(crossings["class"].to_pylist()) == {name}
    for probability in crossings["class_probability"].to_pylist():
        assert probability is None if np.isnan(low) else low < probability <= high


@pytest.mark.parametrize(("hides", "name", "length"), [("merged", "short", 4.0), ("confirmed", "unknown", 6.5)])
def test_without_a_fit_whoever_is_partly_hidden_adds_nothing_and_lengths_that_contradict_name_no_class(
    tmp_path, hides, name, length
):
    """In half of the rows the box is as long as 9 m; there another one shares the blob, or nothing says why."""
    write_run(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)], metres=True)
    path = tmp_path / "run" / "tracks.parquet"
    table = pq.read_table(path)
    odd = np.arange(len(table)) % 2 == 1
    told = {"length_m": np.where(odd, 9.0, 4.0), "status": np.where(odd, hides, "confirmed")}
    for column, values in told.items():
        table = table.set_column(table.column_names.index(column), column, pa.array(values))
    pq.write_table(table, path)
    own = site(CALIBRATED, classes={"short": (3.0, 6.0), "long": (6.0, 12.0)})
    crossings = measured([str(tmp_path / "run")], own).tables["crossings"]
    assert set(crossings["class"].to_pylist()) == {name}
    assert crossings["length_m"].to_pylist() == pytest.approx([length] * len(crossings), abs=0.1)


@pytest.mark.parametrize(("length_m", "said"), [(20.0, False), (21.0, False), (10.0, True), (90.0, True)])
def test_a_section_that_is_not_as_long_as_the_calibration_says_is_told(tmp_path, length_m, said):
    runs = run_with_edges(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)])
    lengths = site(CALIBRATED, sections={"main": {"from": "middle", "to": "east", "length_m": length_m}})
    told = measured(runs, lengths).report["sections"]
    assert len(told) == said
    assert not said or "the calibration the gates are 18.0 to" in told[0]


def test_measures_tell_what_the_points_say_against_their_calibration(tmp_path):
    runs = run_with_edges(tmp_path / "run", [straight(1, 2.0, 20, 240, 120.0, 4.8)])
    assert measured(runs, site(CALIBRATED)).report["calibration"] == []
    points = CALIBRATED["calibration"]
    ground = [*points["ground"][:4], [35, 47], *points["ground"][5:]]
    (told,) = measured(runs, site(CALIBRATED | {"calibration": points | {"ground": ground}})).report["calibration"]
    assert told.startswith("pair 5 of the calibration")
