"""radars.toml: places on the common plane, and what is refused."""

import numpy as np
import pyproj
import pytest

import vidtrack as vt
from vidtrack.radar.network.radars import read_radars


def radars(tmp_path, text):
    (tmp_path / "radars.toml").write_text(text)
    return read_radars(tmp_path / "radars.toml")


def test_a_target_has_one_place_by_its_ranges_and_azimuths_from_both_radars(tmp_path):
    places = {"a": (8.0, 50.0), "b": (9.0, 50.3)}
    tables = (f"[radars.{name}]\nlongitude = {lon}\nlatitude = {lat}\n" for name, (lon, lat) in places.items())
    found = radars(tmp_path, "".join(tables))
    geod, target = pyproj.Geod(ellps="WGS84"), (8.6, 50.25)
    seen = []
    for name, (lon, lat) in places.items():
        azimuth, _, distance = geod.inv(lon, lat, *target)
        one = found.named(name)
        true = np.radians(azimuth) + one.turned
        seen.append(np.array(one.xyz[:2]) + distance * np.array([np.sin(true), np.cos(true)]))
    assert np.linalg.norm(seen[0] - seen[1]) < 5.0
    turned = np.degrees([one.turned for one in found.placed])
    assert turned[0] - turned[1] == pytest.approx(np.sin(np.radians(50.15)), abs=0.01)  # meridians converge
    assert found.origin == pytest.approx((50.15, 8.5, 0.0))


def test_places_in_metres_are_taken_as_they_are(tmp_path):
    found = radars(tmp_path, "[radars.a]\nx_m = 3\ny_m = -4\nheight_m = 5\nboresight_deg = 90\nsac = 1\nsic = 2\n")
    assert found.named("a").xyz == (3.0, -4.0, 5.0)
    assert found.coded(1, 2).turned == pytest.approx(np.pi / 2)
    assert found.origin is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no radar"),
        ("[radars]", "has no radar"),
        ("[radars.a]", "needs a place: latitude and longitude, or x_m and y_m"),
        ("[radars.a]\nx_m = 1", "x_m and y_m belong together"),
        ("[radars.a]\nx_m = 1\ny_m = 1\nlatitude = 1\nlongitude = 1", "needs a place"),
        ("[radars.a]\nx_m = 1\ny_m = 1\nsigma_rnge_m = 1", "did you mean sigma_range_m"),
        ("[radars.a]\nx_m = 1\ny_m = 1\nsigma_range_m = -1", "radars.a.sigma_range_m = -1: input should be greater"),
        ("[radars.a]\nx_m = 1\ny_m = 1\nsac = 1", "sac and sic belong together"),
        ("[radars.a]\nx_m = 1\ny_m = 1\n[radars.b]\nlatitude = 1\nlongitude = 1", "give all radars the same"),
        ("[radar.a]\nx_m = 1\ny_m = 1", "did you mean radars"),
        ("[radars.a]\nx_m = 1\ny_m = 1\nsac=1\nsic=1\n[radars.b]\nx_m = 1\ny_m = 1\nsac=1\nsic=1", "the same sac"),
    ],
)
def test_what_cannot_be_right_is_refused(tmp_path, text, message):
    with pytest.raises(vt.ConfigError, match=message):
        radars(tmp_path, text)


def test_an_unknown_radar_is_refused_with_the_nearest_name(tmp_path):
    found = radars(tmp_path, "[radars.north]\nx_m = 1\ny_m = 1\n")
    with pytest.raises(vt.ConfigError, match="did you mean 'north'"):
        found.named("nort")
    with pytest.raises(vt.ConfigError, match="sac = 1 and sic = 2"):
        found.coded(1, 2)
