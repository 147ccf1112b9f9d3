"""Advice about a source, derived from its measurements.

The limits are from simulated junctions with each problem in increasing strength, tracked with and without the advice.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from vidtrack.config.settings import Settings
from vidtrack.config.video import DisturbanceSettings
from vidtrack.doctor.findings import Findings, Objects, Speed
from vidtrack.video.background.picture import reduction
from vidtrack.video.quality.flicker import Flicker
from vidtrack.video.quality.light import Light
from vidtrack.video.quality.timing import Timing

# time
_DISAGREEMENT = 0.1  # relative, between two sources of a rate
_JITTER = 0.1  # usual intervals
_MISSING, _REPEATED = 0.02, 0.05  # shares of the pictures
_SLOW = 5.0  # pictures/s
_WEAK = 0.7  # of the rate that the camera states
_RESERVE = 0.8  # of the machine
_FOLLOWED = 0.9  # of what is left, so that advice that was followed is not given again
_ENOUGH = 10.0  # pictures/s at which hardly fewer crossings are counted than at 25
# pictures
_THRESHOLD = "detector.disturbance.luma_threshold"
_DIM, _BLACK = 100.0, 25.0  # 95th percentile of the grey level
_DAYLIGHT = 165.0  # the same in daylight, where the default threshold is right
_LEAST_THRESHOLD = 5
_NOISE = 18.0  # grey levels in a processed pixel; from 20 on it becomes foreground
_FLICKER, _BANDS = 0.1, 0.08  # amplitudes
_BAND_THRESHOLDS = 25, 40  # below, edges of bands become foreground; above, vehicles are missed
_CLIPPED = 0.15  # of the picture
_BLOCKS = 1.3
# motion
_MAJORITY = "detector.disturbance.majority_px"
_SHAKE_PX, _STRONG_SHAKE_PX = 1.0, 3.5  # processed pixels from one frame to the next
_SHAKE_THRESHOLD = 25  # grey levels; most edges that shake by a pixel change less
_PAN = 0.05  # of the picture's width
_TINY = 2.2  # times the least detectable size
_TINY_MAJORITY_PX = 5
_RESTLESS = 0.005  # of the picture
_CROWDED = 0.4  # of the picture


@dataclass(frozen=True, slots=True)
class Advice:
    """One piece of advice.

    name     of the finding
    problem  whether it degrades tracking; otherwise it is information
    text     measurement, effect and remedy
    options  of the command line that help
    """

    name: str
    problem: bool
    text: str
    options: tuple[str, ...] = ()


def judge(findings: Findings, settings: Settings) -> list[Advice]:
    """Advice for tracking a source with these settings, problems first.

    A cause suppresses its consequences: noise looks like a shaking camera, and shaking edges look like vehicles.
    """
    noisy = list(on_noise(findings, settings))
    pictures = noisy or [*on_pictures(findings, settings), *on_camera(findings, settings)]
    objects = [] if any(advice.problem for advice in pictures) else list(on_objects(findings, settings))
    said = [*on_time(findings, settings), *pictures, *objects]
    return sorted(said, key=lambda advice: not advice.problem)


def on_time(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on time."""
    yield from _on_reception(findings)
    if findings.timing is not None:
        yield from _on_rate(findings, findings.timing)
        yield from _on_gaps(findings.timing, settings)
    if findings.speed is not None:
        yield from _on_speed(findings, findings.speed, settings)


def _on_reception(findings: Findings) -> Iterator[Advice]:
    lost = findings.reception
    if lost.fps_assumed:
        text = f"nothing states a rate, {findings.fps:g} frames/s are assumed; speeds are wrong by as much as this is"
        yield Advice("rate", True, f"{text}: state the true rate", ("--fps N",))
    if lost.truncated:
        yield Advice("cut short", True, "the file ends before its container says; what is there can be tracked")
    if lost.decode_errors:
        text = f"{lost.decode_errors} pictures were damaged; on a live source use TCP or a better line"
        yield Advice("damage", True, text)
    if lost.reconnects or lost.stalls or lost.gone:
        text = f"the connection stalled {lost.stalls} times and was made anew {lost.reconnects} times"
        end = ", and nothing came at the end" if lost.gone else ""
        yield Advice("connection", True, f"{text}{end}: tracks end in a long gap; look at the network")
    if lost.dropped:
        text = f"{lost.dropped} pictures came faster than this machine decodes them"
        yield Advice("decoding", True, f"{text}: let the camera send a smaller picture, or fewer of them")


def _on_rate(findings: Findings, timing: Timing) -> Iterator[Advice]:
    header = findings.reception.header_fps
    if header is not None and abs(header / findings.fps - 1) > _DISAGREEMENT:
        text = f"the header says {header:g} frames/s, the pictures' times {findings.fps:.4g}; the times are used"
        yield Advice("header", False, f"{text}, --fps overrules both")
    if findings.kind == "live" and timing.rate * (1 - timing.missing_share) < _WEAK * findings.fps:
        text = f"the camera promises {findings.fps:.3g} frames/s and gives {timing.rate:.3g}"
        yield Advice("promise", True, f"{text}: long exposure in the dark, or a weak network")
    if timing.rate < _SLOW:
        text = f"{timing.rate:.3g} frames/s: fast vehicles jump by more than their length from one picture to the next"
        yield Advice("slow", True, f"{text}; take 10 or more")
    if timing.repeated_share > _REPEATED:
        true_rate = timing.rate * (1 - timing.repeated_share)
        text = f"{timing.repeated_share:.0%} of the pictures only repeat the one before: speeds come in jumps"
        yield Advice(
            "repeats", True, f"{text}; set the recorder to the camera's own rate, about {true_rate:.3g} frames/s"
        )


def _on_gaps(timing: Timing, settings: Settings) -> Iterator[Advice]:
    coast_s = settings.tracker.coast_s
    if timing.longest_gap_s > coast_s:
        text = f"up to {timing.longest_gap_s:.2g} s without a picture: tracks are given up after {coast_s:g} s"
        longer = math.ceil(10 * timing.longest_gap_s + 2) / 10
        yield Advice("gaps", True, text, (set_option("tracker.coast_s", longer),))
    elif timing.missing_share > _MISSING:
        yield Advice("gaps", False, f"{timing.missing_share:.0%} of the pictures are missing; tracks coast through")
    if timing.jitter > _JITTER:
        text = f"the intervals vary by {timing.jitter:.0%}; each picture is tracked at its own time"
        yield Advice("variable rate", False, text)


def _on_speed(findings: Findings, speed: Speed, settings: Settings) -> Iterator[Advice]:
    coming = findings.timing.rate if findings.timing else findings.fps
    live = findings.kind == "live"
    needed = min(coming, settings.source.max_fps or math.inf) if live else settings.source.looked_at_fps(coming)
    decoding = coming * (speed.decode_s or 0.0)
    busy = decoding + needed * speed.track_s
    if busy < _RESERVE:
        return
    then = "frames will be dropped" if live else "a file takes longer than it plays, live it would drop"
    text = f"{needed:.3g} frames/s keep this machine busy for {busy:.0%} of the time: {then}"
    left = _RESERVE - decoding
    if left <= 0:
        yield Advice("speed", True, f"{text}; decoding alone is too slow: a smaller picture or a simpler codec")
        return
    fps = math.floor(_FOLLOWED * left / speed.track_s)
    if fps >= _ENOUGH and findings.kind != "recording":
        yield Advice("speed", True, text, (f"--max-fps {fps}",))
        return
    step = math.ceil(reduction(findings.height, settings.source.scale) * math.sqrt(needed * speed.track_s / left))
    yield Advice("speed", True, text, (scale_option(step),))


def on_noise(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on the sensor's noise."""
    step = reduction(findings.height, settings.source.scale)
    if findings.light is not None and findings.light.noise / step > _NOISE:
        text = f"each pixel varies by {findings.light.noise:.0f} grey levels: noise is taken for traffic"
        yield Advice("noise", True, f"{text}; a reduced picture averages it", (scale_option(2 * step),))


def on_pictures(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on light, flicker and compression."""
    if findings.light is not None:
        yield from _on_light(findings.light, settings)
        if findings.flicker is not None:
            yield from _on_flicker(findings.flicker, findings.light, settings)
    if findings.blockiness is not None and findings.blockiness > _BLOCKS:
        text = f"steps at the blocks of the compression are {findings.blockiness:.1f} times those elsewhere"
        yield Advice("compression", False, f"{text}: outlines of small vehicles are rough; more bits help")


def _on_light(light: Light, settings: Settings) -> Iterator[Advice]:
    now = settings.detector.disturbance.luma_threshold
    fitting = max(_LEAST_THRESHOLD, round(DisturbanceSettings().luma_threshold * light.bright / _DAYLIGHT))
    if light.bright < _BLACK:
        text = (
            f"the picture is black, 95 % of it below {light.bright:.0f} of 255: no setting finds vehicles without lamps"
        )
        yield Advice("dark", True, f"{text}; a longer exposure or more light would")
    elif light.bright < _DIM and fitting < now:
        text = (
            f"the picture is dark, 95 % of it below {light.bright:.0f} of 255: dim vehicles differ too little from it"
        )
        yield Advice("dark", True, text, (set_option(_THRESHOLD, fitting),))
    if light.white_share > _CLIPPED:
        text = f"{light.white_share:.0%} of the picture is white: bright vehicles cannot be seen there"
        yield Advice("glare", False, f"{text}; a shorter exposure would show them")


def _on_flicker(flicker: Flicker, light: Light, settings: Settings) -> Iterator[Advice]:
    if flicker.whole > _FLICKER:
        text = f"the light swings by {flicker.whole:.0%} at {flicker.whole_hz:.1f} Hz"
        if settings.detector.disturbance.exposure:
            yield Advice("flicker", False, f"{text}: lamps; the detector follows it")
        else:
            yield Advice("flicker", True, f"{text}: lamps", (set_option("detector.disturbance.exposure", True),))
    if flicker.bands > _BANDS:
        text = f"bands of light run through the picture, {flicker.bands:.0%} bright: lamps and a shutter that differ"
        least, most = _BAND_THRESHOLDS
        threshold = min(most, max(least, round(1.2 * flicker.bands * light.brightness) + 5))
        if settings.detector.disturbance.luma_threshold < threshold:
            yield Advice(
                "bands",
                True,
                f"{text}; set the camera to the mains frequency (1/50 or 1/100 s, 1/60 or 1/120 s), until then",
                (set_option(_THRESHOLD, threshold),),
            )


def on_camera(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on shake and pan."""
    shake, step = findings.shake, reduction(findings.height, settings.source.scale)
    if shake is None:
        return
    if shake.px is None or shake.drift_px is None:
        text = "the picture has too little structure to tell whether the camera shakes"
        yield Advice("structure", False, text)
        return
    threshold = set_option(_THRESHOLD, _SHAKE_THRESHOLD)
    text = f"the camera shakes by {shake.px:.1f} px from one picture to the next: edges become false vehicles"
    if shake.drift_px > _PAN * findings.width:
        text = f"the camera moved by {shake.drift_px:.0f} px while it was watched"
        yield Advice("pan", True, f"{text}: the scene is learnt again and again; vidtrack needs a fixed camera")
    elif shake.px / step > _STRONG_SHAKE_PX:
        text = f"{text}; fix its mount. A reduced picture helps, and hides small vehicles"
        yield Advice("shake", True, text, (scale_option(2 * step), threshold))
    elif shake.px / step > _SHAKE_PX and settings.detector.disturbance.luma_threshold < _SHAKE_THRESHOLD:
        yield Advice("shake", True, f"{text}; fix its mount, until then", (threshold,))


def on_objects(findings: Findings, settings: Settings) -> Iterator[Advice]:
    """Advice on moving objects, for a still camera with good pictures."""
    if findings.objects is not None:
        yield from _on_sizes(findings.objects, settings)
        yield from _on_unrest(findings.objects, settings)


def _on_sizes(objects: Objects, settings: Settings) -> Iterator[Advice]:
    if objects.median_px is None:
        yield Advice("nothing", False, "nothing drove through the picture; watch longer with --seconds")
    elif objects.median_px < _TINY * objects.least_px:
        text = (
            f"half of what drives is below {objects.median_px:.0f} px, and {objects.least_px:.0f} px is the least seen"
        )
        if objects.step > 1:
            yield Advice("tiny", True, text, (scale_option(objects.step // 2),))
        elif settings.detector.disturbance.majority_px > _TINY_MAJORITY_PX:
            text = f"{text}; a camera nearer or with more pixels is better"
            yield Advice("tiny", True, text, (set_option(_MAJORITY, _TINY_MAJORITY_PX),))


def _on_unrest(objects: Objects, settings: Settings) -> Iterator[Advice]:
    if objects.motion_share > _CROWDED:
        text = f"{objects.motion_share:.0%} of the picture moves: too little of the scene is seen to be learnt"
        yield Advice("crowded", True, f"{text}; a wider view is needed")
    if objects.restless_share > _RESTLESS and objects.restless_box is not None and settings.source.mask is None:
        left, top, width, height = objects.restless_box
        text = f"{objects.restless_share:.1%} of the picture moves often without going anywhere: trees, water, a clock"
        where = f"the largest such place is {width} x {height} px at x {left}, y {top}"
        yield Advice("restless", True, f"{text}; {where}; paint it black in a mask", ("--mask IMAGE",))


def set_option(name: str, value: float | bool) -> str:
    """--set NAME=VALUE."""
    shown = str(value).lower() if isinstance(value, bool) else f"{value:g}"
    return f"--set {name}={shown}"


def scale_option(step: int) -> str:
    """--scale for `step` source pixels per processed pixel."""
    return f"--scale {1 / step:.3g}"
