"""Development clips changed in known ways, with their truth: a guard against rules that only fit the clips as they are.

A variant keeps what is counted: frames, lines and directions of the truth are carried over. Written as FFV1, without
loss. A drawn variant (`drawn`) is a chance combination of changes: another part of the picture, begin, size, light,
rate, sensor, encoding, mount.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from zlib import crc32

import av
import cv2
import numpy as np
from av.container import InputContainer
from numpy.random import Generator
from numpy.typing import NDArray
from score_events import Event
from video_clips import Clip, read_line

Picture = NDArray[np.uint8]
SMALLEST_TOLERANCE = 4.0  # frames
DROPS = 8e-4  # a picture and pixel
SWAY_SHARE = 0.9  # of the picture that a swaying camera sees
SETTLE_S = 1.0  # a vehicle that crosses this soon after the first picture may be counted or not
START_SHARE = 0.25  # of a clip's length that is left out, at most
ROOM = 0.12  # of the picture's sides, between a counting line and the edge of a part that is drawn
WHOLE = (0.0, 0.0, 1.0, 1.0)
OTHER_SIDE = {"left": "right", "right": "left"}
FAULT_S, FAULT_LASTS_S = 5.0, 0.6  # when the camera fails, and for how long
RECOVERY_S = 3.0  # after that a crossing counts again
OTHER_WAY = OTHER_SIDE | {"up": "down", "down": "up"}


@dataclass(frozen=True)
class Variant:
    """How a clip is changed.

    every     only every n-th frame
    scale     size of the picture as a share
    start_s   s; what comes before is left out
    part      left, top, right, bottom of the part that is seen, as shares of the picture
    mirror    left and right exchanged
    backward  from the last frame to the first
    doubled   every second frame is the one before it once more, as of a camera that sends more than it sees
    light     factor of the light at a time [s]
    view      changes one picture; called as view(picture, time_s, rng)
    coarse    encoded in H.264 at this constant rate factor first
    sway      standard deviation of the camera's displacement, px at a width of 640; None: the camera stands
    fault     the camera fails at FAULT_S: who crosses in the RECOVERY_S after may be counted or not
    """

    every: int = 1
    scale: float = 1.0
    start_s: float = 0.0
    part: tuple[float, float, float, float] = WHOLE
    mirror: bool = False
    backward: bool = False
    doubled: bool = False
    light: Callable[[float], float] | None = None
    view: Callable[[Picture, float, Generator], Picture] | None = None
    coarse: int | None = None
    sway: float | None = None
    fault: bool = False


def haze(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """Half the contrast under a bright veil, with the sensor's noise."""
    return _noisy(0.5 * picture + 90.0, np.full((1, 1, 1), 3.0), rng)


def dusk(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """A quarter of the light, with the noise of few photons."""
    light = 0.25 * picture + 4.0
    return _noisy(light, np.sqrt(2.0 + 0.3 * light), rng)


def grey(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """No colour."""
    return np.asarray(cv2.cvtColor(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR), np.uint8)


def bright(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """Too much light: pale, and flat where it is bright."""
    return np.rint(255 * (picture / 255.0) ** 0.55).astype(np.uint8)


def noise(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """A poor sensor's noise."""
    return _noisy(picture.astype(np.float32), np.full((1, 1, 1), 9.0), rng)


def rain(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """Streaks of drops, less contrast, and noise."""
    height, width = picture.shape[:2]
    long = int(0.05 * height)
    streaks = np.zeros((height, width), np.float32)
    drops = int(DROPS * height * width)
    for x, y, lit in zip(
        rng.integers(0, width, drops).tolist(), rng.integers(-long, height, drops).tolist(),
        rng.uniform(10, 45, drops).tolist(), strict=True,
    ):  # fmt: skip
        cv2.line(streaks, (x, y), (x + int(0.15 * long), y + long), lit, 1)
    light = 0.8 * picture + 33.0 + streaks[..., None]
    return _noisy(light.astype(np.float32), np.full((1, 1, 1), 3.0), rng)


def snow(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """Flakes that fall, near and far, less contrast, and noise."""
    height, width = picture.shape[:2]
    scale, flakes = width / 640, np.random.default_rng(1)
    count = int(6e-4 * height * width)
    place = flakes.uniform(0, 1, (count, 2)) * (width, height)
    speed = scale * np.column_stack([flakes.normal(20, 30, count), flakes.uniform(60, 160, count)])
    light = (0.75 * picture + 50).astype(np.float32)
    for (x, y), radius in zip(
        np.mod(place + speed * time_s, (width, height)).astype(int).tolist(),
        np.maximum(np.rint(scale * flakes.uniform(0.5, 2.2, count)), 1).astype(int).tolist(), strict=True,
    ):  # fmt: skip
        cv2.circle(light, (x, y), radius, (235, 235, 235), -1)
    return _noisy(light, np.full((1, 1, 1), 2.5), rng)


def glare(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """The light of a low sun beside the picture, added to it near one corner, more and less with thin clouds."""
    height, width = picture.shape[:2]
    y, x = np.mgrid[:height, :width]
    veil = 150 * np.exp(-((np.hypot(x - 0.8 * width, y + 0.1 * height) / (0.5 * width)) ** 2))
    swell = 1 + 0.15 * np.sin(time_s / 2)
    return np.clip(0.9 * picture + swell * veil[..., None], 0, 255).astype(np.uint8)


def clouds(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """Shadows of clouds, 35 % darker, with soft edges, that drift from left to right within seconds."""
    place, covered = divmod(time_s / 5, 2)[1], (time_s / 5) % 4 >= 2
    width = picture.shape[1]
    front = (1.8 * place - 0.4) * width
    lit = 1 / (1 + np.exp(-(np.arange(width) - front) / (0.06 * width)))
    return (picture * (0.65 + 0.35 * (1 - lit if covered else lit)[None, :, None])).astype(np.uint8)


def balance(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """A white balance that wanders: red up and blue down by 12 %, and back."""
    swing = 0.12 * np.sin(time_s / 3)
    return np.clip(picture * np.array([1 + swing, 1.0, 1 - swing]), 0, 255).astype(np.uint8)


def night(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """An eighth of the light, amplified, with the noise of few photons."""
    photons = rng.poisson(1.2 * (0.12 * picture.astype(np.float32) + 2))
    return np.clip(photons * 2.5, 0, 255).astype(np.uint8)


def black(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """No light for a while."""
    return np.zeros_like(picture) if FAULT_S <= time_s < FAULT_S + FAULT_LASTS_S else picture


def damaged(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """Blocks of wrong colours for a while, as after lost packets."""
    if not FAULT_S <= time_s < FAULT_S + FAULT_LASTS_S:
        return picture
    height, width = picture.shape[:2]
    wrong = picture.copy()
    for left, top in zip(rng.integers(0, width - 48, 60), rng.integers(0, height - 16, 60), strict=True):
        wrong[top : top + 16, left : left + 48] = rng.integers(0, 255, 3)
    return wrong


def lightning(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """A flash in two or three pictures."""
    lit = FAULT_S <= time_s < FAULT_S + 0.1
    return np.clip(1.5 * picture + 60, 0, 255).astype(np.uint8) if lit else picture


def knocked(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """The camera is turned a little, and stays so."""
    pixel = picture.shape[1] / 640
    return _moved(picture, np.array([[1, 0, 7 * pixel], [0, 1, -5 * pixel]])) if time_s >= FAULT_S else picture


def zoomed(picture: Picture, time_s: float, rng: Generator) -> Picture:
    """The camera zooms in by 6 %, at once."""
    height, width = picture.shape[:2]
    zoom = cv2.getRotationMatrix2D((width / 2, height / 2), 0, 1.06)
    return _moved(picture, zoom) if time_s >= FAULT_S else picture


def _moved(picture: Picture, move: NDArray) -> Picture:
    height, width = picture.shape[:2]
    return np.asarray(cv2.warpAffine(picture, move, (width, height), borderMode=cv2.BORDER_REPLICATE), np.uint8)


def flicker(time_s: float) -> float:
    """Light of lamps that beat with the camera, and an exposure that jumps every 3.7 s."""
    return 1 + 0.07 * float(np.sin(2 * np.pi * time_s / 2.3)) + 0.12 * (int(time_s / 3.7) % 2)


def _noisy(light: NDArray, sigma: NDArray, rng: Generator) -> Picture:
    noise = sigma * rng.standard_normal(light.shape, dtype=np.float32)
    return np.clip(np.rint(light + noise), 0, 255).astype(np.uint8)


VARIANTS = {
    "every-2nd": Variant(every=2),
    "every-3rd": Variant(every=3),
    "half": Variant(scale=0.5),
    "mirror": Variant(mirror=True),
    "backward": Variant(backward=True),
    "doubled": Variant(doubled=True),
    "flicker": Variant(light=flicker),
    "grey": Variant(view=grey),
    "bright": Variant(view=bright),
    "noise": Variant(view=noise),
    "rain": Variant(view=rain),
    "haze": Variant(view=haze),
    "dusk": Variant(view=dusk),
    "snow": Variant(view=snow),
    "glare": Variant(view=glare),
    "clouds": Variant(view=clouds),
    "balance": Variant(view=balance),
    "night": Variant(view=night),
    "coarse": Variant(coarse=38),
    "sway-0.5": Variant(sway=0.5),
    "sway-1": Variant(sway=1.0),
    "sway-3": Variant(sway=3.0),
}
FAULTS = {
    "black": Variant(view=black, fault=True),
    "damaged": Variant(view=damaged, fault=True),
    "lightning": Variant(view=lightning, fault=True),
    "knocked": Variant(view=knocked, fault=True),
    "zoomed": Variant(view=zoomed, fault=True),
}


def drawn(clip: Clip, seed: int) -> Variant:
    """A chance combination of changes, another one for each clip; the part that is seen holds the counted lines."""
    rng = np.random.default_rng([seed, crc32(clip.name.encode())])
    size, _, length_s = _stream(clip.video)
    ends = np.concatenate([read_line(text)[1] for text in clip.lines]) / size
    low, high = np.clip(ends.min(axis=0) - ROOM, 0, 0.3), np.clip(ends.max(axis=0) + ROOM, 0.7, 1)
    left, top, right, bottom = [*(low * rng.uniform(0, 1, 2)), *(1 - (1 - high) * rng.uniform(0, 1, 2))]
    gamma, gain, veil, sigma = rng.uniform(0.6, 1.6), rng.uniform(0.7, 1.2), rng.uniform(0, 50), rng.uniform(0, 5)

    def view(picture: Picture, time_s: float, rng: Generator) -> Picture:
        light = gain * 255 * (picture / np.float32(255)) ** gamma
        return _noisy(light * (1 - veil / 255) + veil, np.full((1, 1, 1), sigma), rng)

    return Variant(
        every=int(rng.choice([1, 1, 2])),
        scale=float(rng.uniform(0.6, 1.2)),
        start_s=float(rng.uniform(0, min(5, START_SHARE * length_s))),
        part=(left, top, right, bottom),
        mirror=bool(rng.integers(2)),
        view=view,
        coarse=int(rng.integers(26, 36)) if rng.integers(2) else None,
        sway=float(rng.uniform(0.3, 2)) if rng.integers(3) == 0 else None,
    )


def derive(clip: Clip, name: str, folder: Path, variant: Variant | None = None) -> Clip:
    """The variant `name` of a clip with crossings, made in `folder` where it is not there yet."""
    variant = variant or (VARIANTS | FAULTS)[name]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{clip.name}-{name}.mkv"
    size, rate, _ = _stream(clip.video)
    count = sum(1 for _ in _decoded(clip.video)) if variant.backward else 0
    if not path.is_file():
        part = path.with_name(f"part-{path.name}")
        pictures = _pictures(clip.video, variant, float(rate))
        if variant.coarse is not None:
            coarse = path.with_name(f"coarse-{path.name}")
            _write(coarse, pictures, rate, "libx264", {"crf": str(variant.coarse)})
            pictures = _decoded(coarse)
        _write(part, pictures, rate / variant.every)
        part.rename(path)
    lines = tuple(_line(text, variant, size) for text in clip.lines)
    events = tuple(_event(event, variant, count, rate) for event in clip.events)
    seen = tuple(event for event in events if event.frame >= -event.tolerance)
    known = tuple(sorted(_frame(frame, variant, count, rate) for frame in clip.known))
    return replace(clip, name=f"{clip.name}-{name}", video=path, lines=lines, events=seen, known=known, fps=None)


def _stream(video: Path) -> tuple[tuple[int, int], Fraction, float]:
    """Width and height [px], frames/s, and length [s]."""
    with _opened(video) as container:
        stream = container.streams.video[0]
        rate, length = stream.average_rate, container.duration
        assert rate is not None  # all clips with crossings have both
        assert length is not None
        return (stream.width, stream.height), rate, length / av.time_base


def _pictures(video: Path, variant: Variant, rate: float) -> Iterator[Picture]:
    rng = np.random.default_rng(0)
    decoded = list(_decoded(video))[round(variant.start_s * rate) :]
    if variant.backward:
        decoded.reverse()
    if variant.doubled:
        decoded = [decoded[k - k % 2] for k in range(len(decoded))]
    left, top, right, bottom = _pixels(variant, (decoded[0].shape[1], decoded[0].shape[0]))
    width = right - left
    size = _even(variant.scale * width), _even(variant.scale * (bottom - top))
    shifts = np.zeros((len(decoded), 2))
    if variant.sway is not None:
        shifts = variant.sway * size[0] / 640 * _sway(len(decoded), rng)
    for k in range(0, len(decoded), variant.every):
        changed, shift = np.asarray(decoded[k], np.uint8)[top:bottom, left:right], shifts[k]
        if variant.mirror:
            changed = changed[:, ::-1]
        if variant.scale != 1:
            smooth = cv2.INTER_AREA if variant.scale < 1 else cv2.INTER_CUBIC
            changed = np.asarray(cv2.resize(changed, size, interpolation=smooth), np.uint8)
        if variant.sway is not None:
            changed = _window(changed, shift)
        if variant.light is not None:
            changed = np.clip(variant.light(k / rate) * changed, 0, 255).astype(np.uint8)
        if variant.view is not None:
            changed = variant.view(changed, k / rate, rng)
        yield changed


def _opened(video: Path) -> InputContainer:
    """A video, or a folder of pictures in%06d.jpg at 25 frames/s."""
    return av.open(str(video / "in%06d.jpg" if video.is_dir() else video))


def _decoded(video: Path) -> Iterator[Picture]:
    with _opened(video) as container:
        for frame in container.decode(video=0):
            yield np.asarray(frame.to_ndarray(format="bgr24"), np.uint8)


def _sway(count: int, rng: Generator) -> NDArray:
    """(count, 2) displacements of unit standard deviation: a slow random walk about the middle, and a tenth jitter."""
    walk = np.zeros((count, 2))
    speed = np.zeros(2)
    for k in range(1, count):
        speed = 0.9 * speed - 0.02 * walk[k - 1] + rng.standard_normal(2)
        walk[k] = walk[k - 1] + speed
    return (walk - walk.mean(axis=0)) / walk.std(axis=0) + 0.1 * rng.standard_normal((count, 2))


def _window(picture: Picture, shift: NDArray) -> Picture:
    """The middle of a picture, moved by `shift`, enlarged to nothing: a crop between pixels."""
    width, height = _crop(picture.shape[1], picture.shape[0])
    corner = _corner(picture.shape[1], picture.shape[0]) + shift
    move = np.array([[1, 0, corner[0]], [0, 1, corner[1]]])
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(picture, move, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE))


def _crop(width: int, height: int) -> tuple[int, int]:
    return 2 * round(SWAY_SHARE * width / 2), 2 * round(SWAY_SHARE * height / 2)


def _corner(width: int, height: int) -> NDArray:
    return (np.array([width, height]) - _crop(width, height)) / 2


def _even(length: float) -> int:
    return 2 * int(length / 2)


def _pixels(variant: Variant, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of the part that is seen, of a picture of this size [px]."""
    left, top, right, bottom = (_even(share * length) for share, length in zip(variant.part, 2 * size, strict=True))
    return left, top, right, bottom


def _line(text: str, variant: Variant, size: tuple[int, int]) -> str:
    """The line where the variant has it."""
    left, top, right, bottom = _pixels(variant, size)
    name, ends = read_line(text)
    ends -= (left, top)
    if variant.mirror:
        ends[:, 0] = right - left - ends[:, 0]
    ends *= variant.scale
    if variant.sway is not None:
        ends -= _corner(_even(variant.scale * (right - left)), _even(variant.scale * (bottom - top)))
    return f"{name}:{','.join(f'{value:g}' for value in ends.ravel())}"


def _event(event: Event, variant: Variant, count: int, rate: Fraction) -> Event:
    """The crossing as the variant of a clip of `count` frames has it."""
    frame = _frame(event.frame, variant, count, rate)
    if variant.backward:
        return replace(event, frame=frame, direction=OTHER_WAY[event.direction])
    direction = OTHER_SIDE.get(event.direction, event.direction) if variant.mirror else event.direction
    tolerance = event.tolerance if variant.every == 1 else max(event.tolerance / variant.every, SMALLEST_TOLERANCE)
    certain = event.certain and (variant.start_s == 0 or frame * variant.every >= SETTLE_S * rate)
    if variant.fault:
        certain &= not 0 <= frame + tolerance - FAULT_S * rate <= RECOVERY_S * rate + 2 * tolerance
    return replace(event, frame=frame, direction=direction, tolerance=tolerance, certain=certain)


def _frame(frame: float, variant: Variant, count: int, rate: Fraction) -> float:
    """The frame of a variant of a clip of `count` frames that shows the same; it is negative before the first."""
    if variant.backward:
        return count - 1 - frame
    return (frame - round(variant.start_s * float(rate))) / variant.every


def _write(
    path: Path, pictures: Iterator[Picture], rate: Fraction, codec: str = "ffv1", options: dict[str, str] | None = None
) -> None:
    first = next(pictures)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, options=options)
        stream.height, stream.width = first.shape[:2]
        stream.pix_fmt = "yuv420p"
        for picture in (first, *pictures):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))
        container.mux(stream.encode())
