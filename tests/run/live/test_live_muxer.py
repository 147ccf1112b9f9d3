"""One file of a recording: what a kill leaves of it."""

from types import SimpleNamespace

import av
from command_line import SAMPLES

from vidtrack.recording.muxer import Muxer


def test_all_but_the_last_second_is_on_the_disk(tmp_path):
    path = tmp_path / "video.mkv"
    left = []
    with av.open(str(SAMPLES / "crossing.avi")) as camera:
        muxer = Muxer(path, SimpleNamespace(is_raw=False, stream=camera.streams.video[0]))
        for packet in (packet for packet in camera.demux(video=0) if packet.size):
            muxer.take(packet, [], arrived_s=100 + muxer.packets / 10)
            left.append(muxer.packets - packets_in(path))
        muxer.close()
    assert packets_in(path) == muxer.packets == len(left)
    assert 1 <= max(left) <= 11


def packets_in(path):
    """That can be read now, as after a kill."""
    try:
        with av.open(str(path)) as muxer:
            return sum(packet.size > 0 for packet in muxer.demux(video=0))
    except av.FFmpegError:  # nothing but the header
        return 0
