"""Builds the trackers of the settings, for blobs and for a detector's boxes. Does not load OpenCV."""

from __future__ import annotations

from vidtrack.associate.look import Look
from vidtrack.associate.shape import Shape
from vidtrack.associate.two_stage import SINGLE_STAGE, TwoStage
from vidtrack.config.settings import DetectionSettings, Settings, TrackerSettings
from vidtrack.estimate.motion.velocity import ConstantVelocity
from vidtrack.tracking.deferred.forest import ForestRule
from vidtrack.tracking.methods import gate, life, rule
from vidtrack.tracking.occlusion.occlusion import Occlusion
from vidtrack.tracking.occlusion.sharing import Exclusive
from vidtrack.tracking.picture.picture import Picture
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.tracker import Tracker


def box_tracker(settings: Settings | None = None, bounds: tuple[float, float] | None = None) -> Tracker:
    """A tracker for `box_scan`, the boxes of your own detector, as in `vidtrack track det.txt`.

    bounds  (width, height) of the picture [px]: tracks that leave it end at once; None: they end by time alone

    A file of detections supplies settings that are None (acceleration, least score that starts a track). A stream
    cannot: `tracker.accel` then applies, and every box may start a track.
    """
    settings = settings or Settings()
    return build_box_tracker(settings.tracker, settings.detections, bounds)


def build_blob_tracker(
    settings: TrackerSettings,
    bounds: tuple[float, float] | None = None,
    *,
    explain: bool = False,
    smooth: bool = False,
) -> Tracker:
    """The tracker of blobs within bounds (width, height) [px]: a blob may be part of a vehicle, or several vehicles.

    explain  keep each scan's choices, for decisions.csv and rerun
    smooth   keep predictions and gains for the smoother
    """
    associate = rule(settings)
    merging = settings.merged_blobs and not isinstance(associate, ForestRule)
    return Tracker(
        model=_motion(settings, settings.accel),
        associate=associate,
        gate=gate(settings, settings.euclidean_radius_px),
        life=life(
            settings.life,
            settings,
            settings.confirm_hits,
            settings.confirm_window,
            confirm_s=settings.confirm_s,
            confirm_travel=settings.confirm_travel,
            coast_s=settings.coast_s,
            hidden_s=settings.hidden_s,
            coast_scans=None,
            idle_s=settings.idle_s,
            idle_travel=settings.idle_travel,
        ),
        picture=Picture(
            bounds,
            look=Look() if settings.look else None,
            road=Road(*bounds, careful=settings.restless) if bounds else None,
            box_s=settings.box_s,
            relieve=settings.relieve,
        ),
        sharing=_occlusion(settings) if merging else Exclusive(),
        detection_probability=settings.detection_probability,
        clutter_density=settings.clutter_density,
        explain=explain,
        smooth=smooth,
    )


def _occlusion(settings: TrackerSettings) -> Occlusion:
    return Occlusion(cover=settings.group_cover, overlap=settings.blob_overlap, along=settings.parts)


def build_box_tracker(
    settings: TrackerSettings,
    detections: DetectionSettings,
    bounds: tuple[float, float] | None = None,
    *,
    pace: float = 1.0,
    explain: bool = False,
    smooth: bool = False,
) -> Tracker:
    """The tracker of a detector's boxes within bounds (width, height) [px]: each box is one whole object.

    Tracks never share a box; size and score enter the likelihood; M hits in N scans confirm a track even if it does
    not move.

    pace     seconds of scan time per second of the settings; not 1 where the rate of the scans is assumed
    explain  keep each scan's choices, for decisions.csv and rerun
    smooth   keep predictions and gains for the smoother
    """
    return Tracker(
        model=_motion(settings, settings.accel if detections.accel is None else detections.accel, pace),
        associate=rule(settings),
        gate=gate(settings, settings.euclidean_radius_px),
        life=life(
            settings.life,
            settings,
            detections.confirm_hits,
            detections.confirm_window,
            coast_s=settings.coast_s * pace,
            hidden_s=settings.hidden_s * pace,
            coast_scans=None,
        ),
        picture=Picture(bounds, shape=Shape(), box_s=detections.box_s * pace),
        two_stage=SINGLE_STAGE if detections.sure_score is None else TwoStage(detections.sure_score),
        detection_probability=detections.detection_probability,
        clutter_density=settings.clutter_density,
        explain=explain,
        smooth=smooth,
    )


def _motion(settings: TrackerSettings, accel: float, pace: float = 1.0) -> ConstantVelocity:
    """Nearly constant velocity in the picture, acceleration in object sizes; `cross` is proportional to `accel`."""
    accel = accel / pace**2
    return ConstantVelocity(
        dim=2,
        accel=accel,
        cross=accel * settings.cross / settings.accel,
        speed=settings.speed / pace,
        hold_s=settings.hold_s * pace,
        per_size=True,
    )
