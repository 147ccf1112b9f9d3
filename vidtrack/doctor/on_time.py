"""Advice on the frame rate and its regularity, on losses, and on the speed of this machine."""

from __future__ import annotations

import math
from collections.abc import Iterator

from vidtrack.config.settings import Settings
from vidtrack.doctor.advice import Advice, scale_option, set_option
from vidtrack.doctor.findings import Findings, Speed
from vidtrack.video.background.picture import reduction
from vidtrack.video.quality.timing import Timing

_DISAGREEMENT = 0.1  # relative, between two sources of a rate
_JITTER = 0.1  # usual intervals
_MISSING, _REPEATED = 0.02, 0.05  # shares of the pictures
_SLOW = 5.0  # pictures/s
_WEAK = 0.7  # of the rate that the camera states
_RESERVE = 0.8  # of the machine


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
    needed = findings.timing.rate if findings.timing else findings.fps
    if speed.rate * _RESERVE > needed:
        return
    then = (
        "frames will be dropped" if findings.kind == "live" else "a file takes longer than it plays, live it would drop"
    )
    text = f"this machine tracks {speed.rate:.3g} of {needed:.3g} frames/s: {then}"
    left_s = _RESERVE / needed - (speed.decode_s or 0.0)
    if left_s <= 0:
        yield Advice("speed", True, f"{text}; decoding alone is too slow: a smaller picture or a simpler codec")
        return
    step = math.ceil(reduction(findings.height, settings.source.scale) * math.sqrt(speed.track_s / left_s))
    yield Advice("speed", True, text, (scale_option(step),))
