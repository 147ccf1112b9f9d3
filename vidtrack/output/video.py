"""The annotated video: H.264 in fragmented MP4, playable in browsers and after a kill."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream

from vidtrack.config.settings import OutputSettings
from vidtrack.errors import ConfigError, OutputError
from vidtrack.output.draw import Pen, draw_clock, draw_lines, draw_tracks, draw_trails, media_clock, moved_lines
from vidtrack.output.ffmpeg_file import FFmpegFile
from vidtrack.output.folder import writing
from vidtrack.output.sink import Step
from vidtrack.output.trails import Trails
from vidtrack.tracks import Status
from vidtrack.traffic.lines import Line, LineCounter
from vidtrack.video.frame import Image

_CLOCK = Fraction(1, 90_000)
_FRAGMENT_S = 1


class AnnotatedVideo:
    """Sink that draws tracks on the pictures and encodes them with the source's times.

    fps   nominal rate, a hint for the encoder

    Raises OutputError if the file cannot be opened, ConfigError for steps without pictures.
    """

    def __init__(self, path: Path, fps: float, settings: OutputSettings, lines: Sequence[Line] = ()) -> None:
        self._path = path
        self._fps = fps
        self._settings = settings
        self._counter = LineCounter(lines)
        self._trails = Trails(settings.trail_s)
        self._stream: VideoStream | None = None
        self._pts = -1
        try:
            self._file = FFmpegFile(path)
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror}; give --video another file") from None
        self._container: OutputContainer = av.open(
            self._file,
            "w",
            format="mp4",
            options={
                "movflags": "frag_keyframe+empty_moov+default_base_moof",
                "frag_duration": str(_FRAGMENT_S * 1_000_000),
                "flush_packets": "1",
            },
        )

    def step(self, step: Step) -> None:
        """Draw and encode one frame."""
        if step.frame is None:
            raise ConfigError("stored detections have no pictures to draw on; leave --video out")
        self._encode(self._draw(step, step.frame.bgr()), step.time_s)

    def close(self) -> None:
        """Finish the file."""
        if self._stream is not None:
            self._container.mux(self._stream.encode(None))
        self._container.close()
        self._file.close()
        if self._stream is None and self._path.is_file():
            self._path.unlink()  # players reject a video without pictures
        self._check_disk()

    def _draw(self, step: Step, picture: Image) -> Image:
        self._counter.step(step.index, step.tracks)
        self._trails.step(step.tracks)
        pen = Pen(picture)
        draw_lines(pen, moved_lines(self._counter.lines, step.motion), self._counter.totals())
        draw_trails(pen, self._trails.paths(step.motion))
        draw_tracks(pen, step.shown)
        vehicles = int(np.count_nonzero(step.tracks.status != Status.TENTATIVE))
        draw_clock(pen, media_clock(step.time_s), [f"{vehicles} tracks"])
        return picture

    def _encode(self, picture: Image, time_s: float) -> None:
        height, width = picture.shape[:2]
        if self._stream is None:
            self._stream = self._add_stream(width + width % 2, height + height % 2)
        even = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")  # 4:2:0 chroma needs even sides
        frame = av.VideoFrame.from_ndarray(even, format="bgr24")
        self._pts = frame.pts = max(self._pts + 1, round(time_s / _CLOCK))
        frame.time_base = _CLOCK
        self._container.mux(self._stream.encode(frame))
        self._check_disk()

    def _check_disk(self) -> None:
        with writing(self._path):
            if self._file.error is not None:
                raise self._file.error

    def _add_stream(self, width: int, height: int) -> VideoStream:
        stream = self._container.add_stream("libx264", rate=Fraction(self._fps).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.time_base = stream.codec_context.time_base = _CLOCK
        stream.codec_context.gop_size = max(1, round(2 * self._fps))
        # No B-frames: they delay all times, and a fragmented file has no edit list to correct that.
        stream.options = {"crf": str(self._settings.video_crf), "preset": "superfast", "bf": "0"}
        return stream
