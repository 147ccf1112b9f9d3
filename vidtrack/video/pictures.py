"""Image folders and globs as a sequence of pictures."""

from __future__ import annotations

import glob
import re
from collections.abc import Iterable, Iterator
from math import ceil, floor
from pathlib import Path
from typing import cast

import av

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.sequence import read_sequence_info, untimed_rate
from vidtrack.video.stats import SourceStats

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm"})
_DATASET_FOLDERS = ("img1", "input")  # MOTChallenge, CDnet
_DECODERS = {
    b"\xff\xd8": "mjpeg",
    b"\x89PNG": "png",
    b"BM": "bmp",
    b"II*\0": "tiff",
    b"MM\0*": "tiff",
    b"RIFF": "webp",
    b"P5": "pgm",
    b"P6": "ppm",
}


class ImageSequence:
    """One picture per file, in natural order (img2 before img10), at a given frame rate.

    name, place, fps, frames as for Source. An image that cannot be read is counted and skipped; the numbers and times
    of the others do not change. Of more than `max_fps` a second those between are not read.
    """

    def __init__(self, paths: Iterable[Path], settings: SourceSettings, stats: SourceStats) -> None:
        self._paths = sorted(paths, key=_natural)
        self._stats = stats
        self.place = self._paths[0].parent
        info = read_sequence_info(self.place)
        self.name = info.name or _name(self.place.resolve())
        self.fps = untimed_rate(info, settings, stats)
        self._every = round(self.fps / settings.looked_at_fps(self.fps))
        self.frames = len(self._paths)

    def __iter__(self) -> Iterator[tuple[int, float, av.VideoFrame]]:
        for index in range(0, len(self._paths), self._every):
            try:
                picture = _read(self._paths[index])
            except SourceError as error:
                self._stats.count_error(str(error))
                continue
            yield index, index / self.fps, picture

    def between(self, begin_s: float, end_s: float, every_s: float = 0.0) -> Iterator[tuple[float, av.VideoFrame]]:
        """(time, picture) of a span of time; also those less than `every_s` apart."""
        first, last = ceil(begin_s * self.fps - 1e-6), floor(end_s * self.fps + 1e-6)
        looked_at = range(0, min(last + 1, len(self._paths)), self._every)
        for index in looked_at[ceil(max(first, 0) / self._every) :]:
            try:
                yield index / self.fps, _read(self._paths[index])
            except SourceError as error:
                self._stats.count_error(str(error))

    def close(self) -> None:
        """Do nothing: no file stays open between images."""


def images_in(folder: Path) -> list[Path]:
    """The images of a folder, or of a data set's image sub-folder. Raises SourceError if there are none."""
    for place in (*(folder / name for name in _DATASET_FOLDERS), folder):
        images = [path for path in place.iterdir() if _is_image(path)] if place.is_dir() else []
        if images:
            return images
    raise SourceError(f"no images in folder {folder}; their names should end in {', '.join(sorted(SUFFIXES))}")


def images_like(pattern: str) -> list[Path]:
    """The images that match a glob pattern. Raises SourceError if there are none."""
    matches = [Path(match) for match in glob.glob(pattern, recursive=True)]
    images = [path for path in matches if _is_image(path)]
    if not images:
        found = f"{len(matches)} other files, such as {min(matches)}" if matches else "nothing"
        raise SourceError(f"no images match {pattern}; it finds {found}")
    return images


def _is_image(path: Path) -> bool:
    return path.suffix.lower() in SUFFIXES and not path.name.startswith(".") and path.is_file()


def _name(folder: Path) -> str:
    return folder.parent.name if folder.name in _DATASET_FOLDERS else folder.name


def _natural(path: Path) -> list[tuple[str, int]]:
    """Sort key that compares runs of digits as numbers."""
    parts = re.findall(r"(\D*)(\d*)", str(path))
    return [(text, int(digits or -1)) for text, digits in parts]


def _read(path: Path) -> av.VideoFrame:
    """Decode one file by its first bytes; suffixes are unreliable. Raises SourceError."""
    try:
        data = path.read_bytes()
        codec = next((codec for magic, codec in _DECODERS.items() if data.startswith(magic)), None)
        if codec is None:
            raise SourceError(f"cannot read image {path}: it is none of {', '.join(sorted(set(_DECODERS.values())))}")
        pictures = cast(av.VideoCodecContext, av.CodecContext.create(codec, "r")).decode(av.Packet(data))
    except (OSError, av.FFmpegError) as error:
        raise SourceError(f"cannot read image {path}: {error.strerror}") from None
    if not pictures:
        raise SourceError(f"cannot read image {path}: it ends before the picture does")
    return pictures[0]
