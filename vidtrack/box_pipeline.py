"""The tracker that the settings describe, for blobs or a detector's boxes. No pictures, and no OpenCV."""

from __future__ import annotations

from vidtrack.associate.gate import Gate
from vidtrack.associate.shape import Shape
from vidtrack.associate.trust import Trust
from vidtrack.config import DetectionSettings, Settings, TrackerSettings
from vidtrack.estimate.motion import ConstantVelocity
from vidtrack.tracking.border import EXIT_S
from vidtrack.tracking.groups import Groups
from vidtrack.tracking.methods import life, rule
from vidtrack.tracking.road import Road
from vidtrack.tracking.tracker import Tracker


def box_tracker(settings: Settings | None = None, bounds: tuple[float, float] | None = None) -> Tracker:
    """A tracker for `box_scan`, the boxes of your own detector, as `vidtrack track det.txt` has it.

    bounds  (width, height) of the picture [px]: tracks that leave it end at once; None: they end when unseen for long

    What the settings leave open (accelerations, scores that may not start a track) a file tells beforehand and a
    stream cannot: `tracker.accel` holds then, and every box may start a track.
    """
    settings = settings or Settings()
    return build_tracker(settings.tracker, bounds, whole=settings.detections)


def build_tracker(
    settings: TrackerSettings,
    bounds: tuple[float, float] | None = None,
    *,
    whole: DetectionSettings | None = None,
    pace: float = 1.0,
    explain: bool = False,
    smooth: bool = False,
) -> Tracker:
    """The tracker that the settings describe, for scans of boxes in pixels within bounds (width, height).

    whole    settings for stored detections, where each box is one whole object: boxes may overlap but are never
             shared, their size and score are evidence, and M hits of N confirm a track even if it does not move
    pace     seconds of the scans' clock in a second of the settings; not 1 where the rate of the scans is assumed
    explain  keep each scan's choices, for decisions.csv and rerun
    smooth   keep what a smoother needs
    """
    accel = (settings.accel if whole is None or whole.accel is None else whole.accel) / pace**2
    return Tracker(
        model=ConstantVelocity(
            dim=2,
            accel=accel,
            cross=accel * settings.cross / settings.accel,
            speed=settings.speed / pace,
            hold_s=settings.hold_s * pace,
            per_size=True,
        ),
        associate=rule(settings),
        gate=Gate(settings.gate_probability, settings.distance, settings.euclidean_radius_px),
        life=life(
            settings.life,
            settings,
            (whole or settings).confirm_hits,
            (whole or settings).confirm_window,
            confirm_s=0.0 if whole else settings.confirm_s,
            confirm_travel=0.0 if whole else settings.confirm_travel,
            coast_s=settings.coast_s * pace,
            hidden_s=settings.hidden_s * pace,
            coast_scans=None,
            idle_s=None if whole else settings.idle_s,
            idle_travel=settings.idle_travel,
        ),
        groups=Groups(cover=settings.group_cover, overlap=settings.blob_overlap)
        if settings.merged_blobs and not whole
        else None,
        shape=Shape() if whole else None,
        trust=Trust(whole.sure_score) if whole and whole.sure_score is not None else None,
        road=Road(*bounds, wary=settings.restless) if bounds and not whole else None,
        bounds=bounds,
        detection_probability=(whole or settings).detection_probability,
        clutter_density=settings.clutter_density,
        box_s=(whole or settings).box_s * pace,
        exit_s=EXIT_S * pace,
        explain=explain,
        smooth=smooth,
    )
