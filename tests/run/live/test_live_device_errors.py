"""Cameras of this machine, by the errors that V4L2 drivers give: the kernel's virtual driver is not there to test with.

The numbers are those that FFmpeg's V4L2 reader passes on: of open(2) and of the ioctls VIDIOC_QUERYCAP, VIDIOC_S_FMT,
VIDIOC_STREAMON and VIDIOC_DQBUF.
"""

import errno
import os

import av
import pytest
from cameras import Picture, Script, coming, grey, script_of

from vidtrack.config.load import load
from vidtrack.errors import SourceError
from vidtrack.video.live.address import Address, parse_address
from vidtrack.video.live.connection import Connection, Refused
from vidtrack.video.live.source import LiveSource

DEVICE = Address("/dev/video0", "/dev/video0", "video0", "v4l2")


def failing(number):
    return av.FFmpegError(number, os.strerror(number))


@pytest.mark.parametrize(
    ("number", "said", "again"),
    [
        (errno.EBUSY, "another program uses it", True),
        (errno.ENODEV, "it is not plugged in", True),  # unplugged while it is opened
        (errno.ENOENT, "it is not plugged in", True),
        (errno.ENXIO, "it is not plugged in", True),
        (errno.EIO, "it fails (Input/output error)", True),
        (errno.EPROTO, "it fails (Protocol error)", True),  # a USB camera that did not wake up
        (errno.ETIMEDOUT, "it fails (Connection timed out)", True),
        (errno.ENOSPC, "it fails (No space left on device)", True),  # not enough USB bandwidth for another camera
        (errno.EINVAL, "no such size, rate or format", False),
        (errno.ENOTTY, "it is no camera", False),
    ],
)
def test_an_error_at_the_opening_is_told_and_retried_where_that_may_help(monkeypatch, number, said, again):
    monkeypatch.setattr("av.open", lambda *_, **__: (_ for _ in ()).throw(failing(number)))
    with pytest.raises(SourceError) as error:
        Connection(DEVICE, 5.0)
    assert str(error.value).startswith("cannot open /dev/video0: ")
    assert said in str(error.value)
    assert isinstance(error.value, Refused) is not again


def test_no_permission_says_what_to_do(monkeypatch):
    denied = av.error.PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    monkeypatch.setattr("av.open", lambda *_, **__: (_ for _ in ()).throw(denied))
    with pytest.raises(Refused, match="add your user to the group"):
        Connection(DEVICE, 5.0)


class Failing:
    """A container whose device fails after some packets."""

    def __init__(self, number):
        self._number = number

    def demux(self):
        yield from ()
        raise failing(self._number)


@pytest.mark.parametrize("number", [errno.ENODEV, errno.EIO, errno.EINVAL])
def test_an_error_while_it_runs_ends_the_connection_and_not_the_run(number):
    """Whatever the driver says, it has worked before."""
    connection = Connection.__new__(Connection)
    connection._container, connection._address, connection._timeout_s = Failing(number), DEVICE, 60.0
    with pytest.raises(SourceError) as error:
        list(connection.packets())
    assert not isinstance(error.value, Refused)
    assert str(error.value).startswith("lost /dev/video0 after 0.0 s: ")


def test_a_camera_that_is_unplugged_and_comes_back_goes_on():
    """While it is away it even seems to be no camera at all: another device may have its number for a moment."""
    lost = SourceError("lost /dev/video0 after 1.0 s: No such device")
    gone, stranger = SourceError("it is not plugged in"), Refused("it is no camera (Inappropriate ioctl for device)")
    shown = [act for level in (50, 60, 70) for act in (0.02, Picture(grey(level)))]
    before, after = Script(*shown, 0.02, lost), Script(*shown, 0.3)
    settings = load(assignments=["live.backoff_s=0.01", "live.every_frame=true"]).live
    with LiveSource(DEVICE, settings, connect=script_of(before, gone, stranger, gone, after)) as source:
        frames = coming(source)
        assert [int(next(frames).y[0, 0]) for _ in range(6)] == [50, 60, 70] * 2
        assert source.stats.reconnects == 1
        assert [text for _, text in source.stats.problems if "not plugged in" in text]


def test_an_index_and_a_device_are_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr("pathlib.Path.exists", lambda path: str(path) == "/dev/video3")
    assert parse_address("3", 5.0) == parse_address("/dev/video3", 5.0)
    assert parse_address("3", 5.0).is_device
