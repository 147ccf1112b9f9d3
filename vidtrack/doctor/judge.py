"""What the measurements mean for a run.

The limits are from simulated junctions with each trouble in growing strength, tracked with and without the advice.
"""

from __future__ import annotations

from vidtrack.config.settings import Settings
from vidtrack.doctor.advice import Advice
from vidtrack.doctor.findings import Findings
from vidtrack.doctor.on_motion import on_camera, on_objects
from vidtrack.doctor.on_pictures import on_noise, on_pictures
from vidtrack.doctor.on_time import on_time


def judge(findings: Findings, settings: Settings) -> list[Advice]:
    """Everything to say about a source that will be tracked with these settings, problems first.

    Causes hide consequences: noise seems to shake the camera, and where the camera shakes, edges seem to drive.
    """
    noisy = list(on_noise(findings, settings))
    pictures = noisy or [*on_pictures(findings, settings), *on_camera(findings, settings)]
    objects = [] if any(advice.problem for advice in pictures) else list(on_objects(findings, settings))
    said = [*on_time(findings, settings), *pictures, *objects]
    return sorted(said, key=lambda advice: not advice.problem)
