"""Derives advice from the measurements.

The limits are from simulated junctions with each problem in increasing strength, tracked with and without the advice.
"""

from __future__ import annotations

from vidtrack.config.settings import Settings
from vidtrack.doctor.advice import Advice
from vidtrack.doctor.findings import Findings
from vidtrack.doctor.on_motion import on_camera, on_objects
from vidtrack.doctor.on_pictures import on_noise, on_pictures
from vidtrack.doctor.on_time import on_time


def judge(findings: Findings, settings: Settings) -> list[Advice]:
    """Advice for tracking a source with these settings, problems first.

    A cause suppresses its consequences: noise looks like a shaking camera, and shaking edges look like vehicles.
    """
    noisy = list(on_noise(findings, settings))
    pictures = noisy or [*on_pictures(findings, settings), *on_camera(findings, settings)]
    objects = [] if any(advice.problem for advice in pictures) else list(on_objects(findings, settings))
    said = [*on_time(findings, settings), *pictures, *objects]
    return sorted(said, key=lambda advice: not advice.problem)
