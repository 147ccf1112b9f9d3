"""Does a detection threshold of each track's own (paper 000) help with video?

The blobs of a video go through the tracker twice: as the detector found them, and with a threshold controller whose
SNR is estimated from the blobs' disturbance. Says how strong blobs are, how high the controller's thresholds get, and
in how many frames the tracks differ.

    python tools/measure_video_threshold.py samples/junction.avi
    python tools/measure_video_threshold.py samples/junction.avi --share 0.5
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from vidtrack.amplitude.densities import RAYLEIGH
from vidtrack.amplitude.threshold import ThresholdController
from vidtrack.config.settings import Settings
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, video_steps
from vidtrack.video.source import open_source


def main() -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video")
    parser.add_argument("--share", type=float, default=1.0, help="of the detector's usual threshold")
    given = parser.parse_args()
    usual = Settings().detector.disturbance
    level = usual.noise_factor * given.share
    lowered = {"noise_factor": level, "luma_threshold": usual.luma_threshold * given.share}
    settings = Settings.model_validate({"detector": {"disturbance": lowered}})

    with open_source(given.video, settings.source) as source:
        bounds = source.width, source.height
        tracker = build_blob_tracker(settings.tracker, bounds)
        steps = list(video_steps(source, build_detector(settings), tracker, settings))
    scans = [replace(step.scan, amplitude=level * step.scan.amplitude) for step in steps]
    amplitude = np.concatenate([scan.amplitude for scan in scans])
    snr = (np.mean(amplitude**2) - level**2) / 2 - 1
    cell = settings.blobs.min_area_share * bounds[0] * bounds[1]
    controller = ThresholdController(snr, cell, p_fa_max=float(RAYLEIGH.survival(level)))

    plain, own = build_blob_tracker(settings.tracker, bounds), build_blob_tracker(settings.tracker, bounds)
    own.threshold = controller
    thresholds, differ = [], 0
    for scan in scans:
        S = plain.predict(scan.t).xy_cov + (0 if scan.noise is None else scan.noise)
        thresholds.append(RAYLEIGH.threshold(controller.p_fa(S)))
        one, other = plain.step(scan), own.step(scan)
        differ += not (np.array_equal(one.id, other.id) and np.array_equal(one.measurement, other.measurement))
    print(f"{len(amplitude)} blobs, amplitudes 1, 10, 50 %: {np.percentile(amplitude, [1, 10, 50]).round(1)} noises")
    print(f"SNR {10 * np.log10(snr):.1f} dB, cell {cell:.1f} px^2, the detector's threshold {level:g} noises")
    percentiles = np.percentile(np.concatenate(thresholds), [1, 50, 99]).round(1)
    print(f"the tracks' thresholds 1, 50, 99 %: {percentiles} noises")
    print(f"tracks differ in {differ} of {len(scans)} frames")


if __name__ == "__main__":
    main()
