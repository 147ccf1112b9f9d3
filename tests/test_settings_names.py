"""What users choose by name is what there is to choose from."""

from typing import get_args

import numpy as np
import pytest
from click import Choice

from vidtrack.cli import radar, track
from vidtrack.config import names
from vidtrack.config.radar import RadarSettings
from vidtrack.config.settings import TrackerSettings
from vidtrack.config.video import DetectorSettings
from vidtrack.estimate import resampling
from vidtrack.radar.filters import estimator, motion
from vidtrack.tracking.methods import METHODS, rule
from vidtrack.video import background
from vidtrack.video.frame import Frame


def test_every_association_method_has_a_name():
    assert set(get_args(names.Method)) == set(METHODS)
    made = {repr(rule(TrackerSettings(method=method))) for method in METHODS}
    assert len(made) == len(METHODS)


def test_every_detector_motion_model_and_resampling_can_be_made():
    frame, none = Frame.blank((48, 64), False), np.empty((0, 4))
    for kind in get_args(names.Detector):
        assert background.create(DetectorSettings(kind=kind)).apply(frame, none).mask.shape == (48, 64)
    models = [motion(RadarSettings(model=model), 2) for model in get_args(names.Model)]
    assert len({type(model) for model in models}) == len(models)
    schemes = {name.lower() for name in resampling.Resampling.__members__} | {"error-signal"}
    assert set(get_args(names.Resampling)) == schemes


@pytest.mark.parametrize("name", get_args(names.Estimator))
def test_every_estimator_makes_a_bank(name):
    class Found:
        dim = 2
        R = 25.0 * np.eye(2)[None]

    settings = RadarSettings(estimator=name)
    assert len(estimator(settings, Found)(motion(settings, 2))) == 0


@pytest.mark.parametrize(
    ("command", "option", "kind"),
    [
        (track.command, "method", names.Method),
        (track.command, "distance", names.Distance),
        (track.command, "detector", names.Detector),
        (radar.command, "estimator", names.Estimator),
        (radar.command, "model", names.Model),
    ],
)
def test_the_command_line_offers_the_same_names(command, option, kind):
    (offered,) = (parameter.type for parameter in command.params if parameter.name == option)
    assert isinstance(offered, Choice)
    assert tuple(offered.choices) == get_args(kind)
