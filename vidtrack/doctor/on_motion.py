"""Advice on the camera's motion, the size of objects, and motion without travel."""

from __future__ import annotations

from collections.abc import Iterator

from vidtrack.config.settings import Settings
from vidtrack.doctor.advice import Advice, scale_option, set_option
from vidtrack.doctor.findings import Findings, Objects
from vidtrack.video.background.picture import reduction

_THRESHOLD, _MAJORITY = "detector.disturbance.luma_threshold", "detector.disturbance.majority_px"
_SHAKE_PX, _STRONG_SHAKE_PX = 1.0, 3.5  # processed pixels from one frame to the next
_SHAKE_THRESHOLD = 25  # grey levels; most edges that shake by a pixel change less
_PAN = 0.05  # of the picture's width
_TINY = 2.2  # times the least detectable size
_TINY_MAJORITY_PX = 5
_RESTLESS = 0.005  # of the picture
_CROWDED = 0.4  # of the picture


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
