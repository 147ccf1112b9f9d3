"""What the charts of a report draw."""

import cv2
import numpy as np
from matplotlib.colors import to_rgb

from vidtrack.output.report.charts import over_the_day, speed_histograms
from vidtrack.output.report.style import BLUE, PALE, SIGNAL
from vidtrack.traffic.clock import Clock
from vidtrack.traffic.report.legs import LegDay
from vidtrack.traffic.report.speeds import Speeds, v85_of


def shows(png, colour):
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    return int((np.abs(picture - 255 * np.array(to_rgb(colour))) < 1.5).all(axis=2).sum()) > 200


def test_an_interval_watched_in_part_is_pale():
    height = np.array([40.0])
    leg = LegDay("north", height, height, height)
    for share, colour, other in ((1.0, BLUE, PALE), (0.3, PALE, BLUE)):
        png = over_the_day([leg], [height], "vehicles/h", Clock(None), np.array([0.0, 900.0]), np.array([share]))
        assert shows(png, colour)
        assert not shows(png, other)


def test_too_few_speeds_have_no_line_of_v85():
    for count in (22, 23):
        speed = np.linspace(30, 60, count)
        one = Speeds("gate", "up", speed, *v85_of(speed, 0, 0), 0.0, 0.0)
        assert shows(speed_histograms([one]), SIGNAL) == (count == 23)
