"""The file of a site: what it may hold, and what is refused in which words."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import ConfigError
from vidtrack.traffic.polyline import crosses_itself
from vidtrack.traffic.site import read_site

WHOLE = """
[site]
name = "junction-3d"
start = 2026-06-01T07:00:00+02:00
width = 1280
height = 720
[calibration]
picture = [[100, 100], [1000, 100], [1200, 700], [50, 690]]
ground = [[0, 50], [20, 50], [12, 0], [0, 0]]
sigma_picture_px = 2.0
camera_height_m = 8.0
[gates.north_in]
line = [[10, 20], [30, 40]]
leg = "north"
role = "entry"
[gates.south]
line = [[10, 20], [30, 40], [50, 40]]
[zones.box]
polygon = [[0, 0], [10, 0], [10, 10]]
[sections.main]
from = "north_in"
to = "south"
length_m = 40.0
[movements]
allowed = [["north", "south"]]
[classes]
car = [3.2, 5.4]
[report]
interval_s = 300
"""


@pytest.fixture
def read(tmp_path):
    def of(text):
        path = tmp_path / "site.toml"
        path.write_text(text, encoding="utf-8")
        return read_site(path)

    return of


def test_a_site_is_read(read):
    site = read(WHOLE)
    assert site.camera.name == "junction-3d"
    assert site.camera.start == datetime(2026, 6, 1, 5, tzinfo=UTC)
    assert site.calibration.ground[2] == (12.0, 0.0)
    assert site.calibration.sigma_ground_m == 0.02
    assert site.gates["north_in"].role == "entry"
    assert site.gates["south"].role == "neutral"
    assert site.legs == ("north", "south")
    assert site.sections["main"].from_gate == "north_in"
    assert site.classes == {"car": (3.2, 5.4)}
    assert site.report.interval_s == 300


def test_the_picture_alone_is_a_site(read):
    site = read('[site]\nname = "a"\nwidth = 10\nheight = 10\n')
    assert site.calibration is None
    assert site.camera.start is None
    assert not site.gates
    assert site.report.interval_s == 900


BAD = {
    "unknown key": ("leg =", "lge =", "unknown key gates.north_in.lge; did you mean leg?"),
    "unknown section": ("[zones.box]", "[zone.box]", "unknown key zone; did you mean zones?"),
    "unknown key of the calibration": ("camera_height_m", "camera_heigth", "did you mean camera_height_m?"),
    "no zone": ("07:00:00+02:00", "07:00:00", "write date, time and zone"),
    "unknown gate": ('from = "north_in"', 'from = "nort_in"', "no such gate; did you mean north_in?"),
    "section of one gate": ('to = "south"', 'to = "north_in"', "name two gates"),
    "unknown leg": ('"north", "south"', '"nroth", "south"', "no gate is on a leg 'nroth'; did you mean north?"),
    "no length": ("length_m = 40.0", "length_m = 0", "greater than 0"),
    "formula as a name": ("[gates.south]", '[gates."=1+1"]', "a name begins with a letter or a digit"),
    "cell as a name": ('leg = "north"', 'leg = "north,south"', "a name begins with a letter or a digit"),
    "tag as a name": ('"junction-3d"', '"<script>"', "a name begins with a letter or a digit"),
    "crossing polygon": ("[[0, 0], [10, 0], [10, 10]]", "[[0, 0], [9, 9], [9, 0], [0, 9]]", "polygon crosses itself"),
    "two corners": ("[[0, 0], [10, 0], [10, 10]]", "[[0, 0], [9, 9], [0, 0]]", "at least 3 corners"),
    "crossing gate": ("[30, 40], [50, 40]]", "[30, 40], [30, 20], [10, 40]]", "the line crosses itself"),
    "gate of one point": ("[[10, 20], [30, 40], [50, 40]]", "[[10, 20]]", "a line needs at least 2 points"),
    "gate without length": ("[[10, 20], [30, 40], [50, 40]]", "[[10, 20], [10, 20]]", "stands twice in a row"),
    "gate outside": ("[50, 40]]", "[1900, 40]]", "point (1900, 40) of south lies outside the 1280 x 720 picture"),
    "zone outside": ("[10, 0], [10, 10]]", "[10, 0], [10, -10]]", "of box lies outside"),
    "calibration outside": ("[1200, 700]", "[1200, 800]", "of picture lies outside"),
    "not a number": ("[10, 0], [10, 10]]", "[10, 0], [10, nan]]", "finite number"),
    "unequal": (", [50, 690]]", "]", "3 points in picture, 4 in ground"),
    "twice": ("[50, 690]", "[100, 100]", "the point (100, 100) stands twice in picture"),
    "ground beyond the Earth": ("[12, 0],", "[1e300, 0],", "the point (1e+300, 0) in ground is farther away"),
    "unknown role": ('role = "entry"', 'role = "in"', "'entry', 'exit', 'both' or 'neutral'"),
    "bounds": ("[3.2, 5.4]", "[5.4, 3.2]", "write the shortest length, then the longest"),
    "classes that overlap": ("[3.2, 5.4]", "[3.2, 5.4]\nvan = [4, 6]", "car, 3.2 to 5.4 m, and van, 4 to 6 m, overlap"),
    "a class of its own name": ("car = [3.2", "unknown = [3.2", "[classes]: unknown is the class of vehicles of which"),
    "no width": ("width = 1280\n", "", "site.width is missing"),
    "no interval": ("interval_s = 300", "interval_s = 0", "greater than or equal to 1"),
    "more intervals than memory": ("interval_s = 300", "interval_s = 1e-6", "greater than or equal to 1"),
    "interval longer than a day": ("interval_s = 300", "interval_s = 1e12", "less than or equal to 86400"),
    "geographic without a system": ("camera_height_m = 8.0", "geographic = true", "geographic needs epsg"),
    "no coordinate system": ("camera_height_m = 8.0", "epsg = 999999", "epsg = 999999: no such coordinate system"),
    "system in feet": ("camera_height_m = 8.0", "epsg = 2263", "(ftUS) does not measure in metres on a plane"),
    "system in degrees": ("camera_height_m = 8.0", "epsg = 4326", "the system WGS 84 does not measure in metres"),
    "system in degrees, of degrees": ("camera_height_m = 8.0", "geographic = true\nepsg = 4326", "WGS 84 does not"),
    "lens without focal length": ("camera_height_m = 8.0", "distortion = [0.1, 0]", "needs focal_px"),
    "lens without a name": ("camera_height_m = 8.0", 'distortion = "auto"', 'give [k1, k2], or "fit" for k1'),
    "lens of one number": ("camera_height_m = 8.0", "distortion = [0.1]", 'give [k1, k2], or "fit" for k1'),
    "lens of four points": ("camera_height_m = 8.0", 'distortion = "fit"', "needs at least 6 pairs of points"),
    "both kinds": ("camera_height_m = 8.0", "lengths = [[[0, 0], [0, 9], 3.0]]", "and not both"),
    "no section but a value": ("[report]", "[sections]\nmain = 3\n[report]", "not valid TOML"),
}


@pytest.mark.parametrize(("good", "bad", "words"), BAD.values(), ids=BAD)
def test_a_mistake_is_refused_in_one_line(read, good, bad, words):
    assert good in WHOLE
    with pytest.raises(ConfigError) as refused:
        read(WHOLE.replace(good, bad))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert "site.toml" in str(refused.value)


DEGREES = [[9.0, 52.0005], [9.0003, 52.0005], [9.0002, 52.0], [9.0, 52.0]]
EQUATOR = [[179.9, -0.0005], [179.9003, -0.0005], [179.9002, 0.0], [179.9, 0.0]]
METRES = {  # the same in metres of each system
    3857: [[1001875, 6800125], [1001908, 6800125], [1001897, 6800043], [1001875, 6800043]],
    25832: [[500000, 5761094], [500020, 5761094], [500014, 5761038], [500000, 5761038]],
}


def placed(ground, epsg, *, geographic):
    return WHOLE.replace("[[0, 50], [20, 50], [12, 0], [0, 0]]", str(ground)).replace(
        "camera_height_m = 8.0", f"epsg = {epsg}\ngeographic = {str(geographic).lower()}"
    )


@pytest.mark.parametrize(
    ("epsg", "ground", "scale"),
    [
        (3857, DEGREES, "1.624"),
        (3857, METRES[3857], "1.624"),
        (3395, DEGREES, "1.621"),
        (6933, DEGREES, "1.405"),
        (3034, DEGREES, "0.966"),
        (32631, [[lon + 20, lat] for lon, lat in DEGREES], "1.038"),
    ],
)
def test_a_system_that_is_not_true_to_lengths_there_is_refused_and_one_named(read, epsg, ground, scale):
    with pytest.raises(ConfigError) as refused:
        read(placed(ground, epsg, geographic=ground is not METRES.get(epsg)))
    assert f"epsg = {epsg}" in str(refused.value)
    assert f"its lengths are {scale} times those on the ground" in str(refused.value)
    assert f"for example {32635 if epsg == 32631 else 32632}, the UTM zone of the place" in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("epsg", [25832, 27700, 3857, 2154, 5514])
def test_own_metres_under_a_system_are_refused_with_the_advice_to_drop_it(read, epsg):
    with pytest.raises(ConfigError, match=f"metres from a point of your own.*leave epsg = {epsg} out") as refused:
        read(placed([[0, 50], [20, 50], [12, 0], [0, 0]], epsg, geographic=False))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("epsg", [6677, 3377])  # a zone of Japan, Johor
def test_a_system_whose_zero_point_is_inland_has_sites_beside_it(read, epsg):
    assert read(placed([[0, 50], [20, 50], [12, 0], [0, 0]], epsg, geographic=False)).calibration.epsg == epsg


def test_points_beyond_what_a_system_maps_are_refused(read):
    with pytest.raises(ConfigError, match="outside the region of epsg = 2154"):
        read(placed([[2 + 0.01 * k, -90 + 0.01 * k * k] for k in range(4)], 2154, geographic=True))


@pytest.mark.parametrize(
    ("epsg", "ground"),
    [
        (25832, DEGREES),
        (25832, METRES[25832]),
        (25832, [[lon + 6, lat] for lon, lat in DEGREES]),  # a country may use one zone for all
        (3035, DEGREES),  # of equal area, but true near its middle
        (32760, EQUATOR),
    ],
)
def test_a_system_that_is_nearly_true_to_lengths_is_taken(read, epsg, ground):
    assert read(placed(ground, epsg, geographic=ground is not METRES.get(epsg))).calibration.epsg == epsg


def test_three_points_are_refused(read):
    three = WHOLE.replace(", [50, 690]]", "]").replace(", [0, 0]]\ns", "]\ns")
    with pytest.raises(ConfigError, match="3 pairs of points; a plane needs at least 4"):
        read(three)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="cannot read site"):
        read_site(tmp_path / "none.toml")


def test_another_size_of_the_picture(read):
    site = read(WHOLE)
    half = site.scaled(640, 360)
    assert half.gates["north_in"].line == ((4.75, 9.75), (14.75, 19.75))
    assert half.calibration.ground == site.calibration.ground
    assert half.calibration.sigma_picture_px == 1.0
    assert site.scaled(1280, 720) is site
    back = half.scaled(1280, 720)
    assert np.allclose(back.calibration.picture, site.calibration.picture)
    assert back.zones["box"].polygon == site.zones["box"].polygon


@pytest.mark.parametrize("size", [(1280, 960), (720, 1280), (640, 350)])
def test_another_shape_is_never_guessed(read, size):
    with pytest.raises(ConfigError, match="not the same shape"):
        read(WHOLE).scaled(*size)


@pytest.mark.parametrize("name", ["A 12", "Königstraße", "in_1", "3.2-b"])
def test_names_that_are_allowed(read, name):
    assert name in read(WHOLE.replace("[zones.box]", f'[zones."{name}"]')).zones


@given(st.text(min_size=1, max_size=70))
def test_a_name_that_is_allowed_is_safe_in_every_table(name):
    from pydantic import TypeAdapter, ValidationError

    from vidtrack.traffic.shapes import Name

    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        return
    assert name[0].isalnum()
    assert not set(name) & set(",;\"'<>&=+@|\t\r\n\\/")
    assert name == name.strip()


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=6, unique=True))
def test_a_polygon_that_does_not_cross_itself_has_the_same_area_by_counting(corners):
    """A simple polygon holds each point with a winding number of 0 or +-1; the area by rays agrees with the formula."""
    points = np.array(corners, float)
    if crosses_itself(points, closed=True):
        return
    x, y = np.moveaxis(np.stack(np.meshgrid(np.arange(0, 6, 0.1) + 0.05, np.arange(0, 6, 0.1) + 0.05)), 0, 0)
    inside = np.zeros(x.shape, bool)
    for (x1, y1), (x2, y2) in zip(points, np.roll(points, -1, axis=0), strict=True):
        if y1 != y2:
            inside ^= ((y1 > y) != (y2 > y)) & (x < (x2 - x1) * (y - y1) / (y2 - y1) + x1)
    nxt = np.roll(points, -1, axis=0)
    area = abs(np.sum(points[:, 0] * nxt[:, 1] - nxt[:, 0] * points[:, 1])) / 2
    assert abs(inside.sum() * 0.01 - area) < 0.15 * len(points)
