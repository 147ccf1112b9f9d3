"""Cameras that come up after the machine that tracks them."""

import json

import pytest
from cameras import Picture, Script, coming, grey, script_of, wait_for
from live_runs import settings

from vidtrack.errors import SourceError
from vidtrack.run.live.cameras import Entry, settings_of
from vidtrack.run.live.view import View
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Refused, Stalled
from vidtrack.video.live.source import LiveSource

PLACE = parse_address("rtsp://camera.local/1", 5.0)
LATE = [
    SourceError("connection refused"),
    Stalled("no answer"),
    SourceError("the host name is unknown"),
    SourceError("404"),
    SourceError("connection refused"),
]
DELIVERS = Script(0.01, Picture(grey(90), 0.0), 0.01, Picture(grey(90), 0.04))


def of_several(*assignments):
    return settings_of(Entry("north", "rtsp://camera.local/1", {}), {}, None, ["live.backoff_s=0.01", *assignments])


def test_one_of_several_cameras_is_waited_for():
    with LiveSource(PLACE, of_several().live, connect=script_of(*LATE, DELIVERS)) as source:
        assert next(coming(source)).index == 0
        assert [what for _, what in source.stats.problems][1:5] == [str(error) for error in LATE[1:]]


def test_one_that_refuses_the_password_is_not():
    with pytest.raises(Refused, match="401"):
        LiveSource(PLACE, of_several().live, connect=script_of(LATE[0], Refused("401"), DELIVERS))


def test_one_camera_alone_is_given_up_in_words_unless_told_otherwise():
    quick = settings("live.backoff_s=0.01").live
    with pytest.raises(SourceError, match="unknown"):
        LiveSource(PLACE, quick, connect=script_of(*LATE, DELIVERS))
    patient = settings("live.backoff_s=0.01", "live.retry_first=true").live
    with LiveSource(PLACE, patient, connect=script_of(*LATE, DELIVERS)) as source:
        assert next(coming(source)).index == 0


def test_the_list_may_say_otherwise():
    assert not of_several("live.retry_first=false").live.retry_first


def test_the_page_tells_what_is_waited_for():
    view = View(PLACE.shown)
    told = []

    def connect():
        told.append(view.status())
        if len(told) < 3:
            raise SourceError("connection refused; is the camera on?")
        return DELIVERS

    with LiveSource(PLACE, of_several().live, connect=connect, stats=view.stats):
        wait_for(lambda: len(told) > 2)
    assert {status["state"] for status in told} == {"connecting"}
    assert "is the camera on" in told[2]["problems"][-1][1]
    assert view.picture() is None
    assert json.loads(json.dumps(view.ended("it broke")))["problems"][-1][1] == "it broke"
