"""Runs the command line as a user does, from this checkout, and small inputs for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import av

ROOT = Path(__file__).parent.parent
SAMPLES = ROOT / "samples"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def start(*arguments, cwd, program=("-m", "vidtrack"), stderr=subprocess.PIPE, **options):
    """A running `vidtrack`, or another program of this Python, with its output in pipes."""
    command = [sys.executable, *program, *map(str, arguments)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=cwd, stdout=pipe, stderr=stderr, text=True, env=ENVIRONMENT, **options)


def first_frames(source, target, count):
    """Copy the first `count` pictures of a video; frames that lean on others stay decodable."""
    loop_video(source, target, times=1, count=count)


def loop_video(source, target, times, count=None):
    """Write a video's packets `times` times over, as they are."""
    with av.open(str(target), "w") as output:
        stream = None
        number = 0
        for _ in range(times):
            with av.open(str(source)) as original:
                video = original.streams.video[0]
                if stream is None:
                    stream = output.add_stream_from_template(video)
                    stream.time_base = 1 / video.average_rate
                for packet in original.demux(video):
                    if packet.size == 0 or number == count:
                        continue
                    packet.stream = stream
                    packet.time_base = 1 / video.average_rate
                    packet.pts = packet.dts = number
                    number += 1
                    output.mux(packet)
