"""The percentiles that tell contrast and haze, against NumPy's."""

import numpy as np
import pytest

from vidtrack.video.background.distance import contrast, haziness, veil


def views():
    """Scenes (h, w) of 8-bit levels, from smooth to rough, with few edges and with many."""
    noise = np.random.default_rng(0)
    for h, w, rough, flat in (
        (40, 60, 3, 0.5),
        (97, 131, 30, 0.97),
        (64, 64, 60, 0.0),
        (5, 7, 20, 0.3),
        (48, 48, 0, 1.0),
    ):
        level = 90 + noise.normal(0, rough, (h, w)) * (noise.random((h, w)) > flat)
        yield np.clip(level, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("luma", list(views()), ids=lambda luma: "x".join(map(str, luma.shape)))
class TestPercentiles:
    def test_contrast_is_the_99th_percentile_of_edges_in_four_rows(self, luma):
        scene = luma.astype(np.float32)
        steep = np.percentile(np.abs(scene[::4, 2:] - scene[::4, :-2]), 99)
        assert contrast(scene) == np.float32(np.clip(steep / 40, 0.5, 1))

    def test_haze_is_told_by_the_steepest_edge_in_a_thousand(self, luma):
        scene = luma.astype(np.float32)
        across, down = np.abs(scene[::4, 2:] - scene[::4, :-2]), np.abs(scene[2:, ::4] - scene[:-2, ::4])
        steepest = max(np.percentile(across, 99.9), np.percentile(down, 99.9))
        assert haziness(scene) == np.float32(np.clip((65 - steepest) / 15, 0, 1))

    def test_the_veil_is_the_darkest_half_percent_if_it_stands_out(self, luma):
        dark, low, median, high = np.percentile(luma[::4], (0.5, 25, 50, 75))
        expected = None if median - dark < 1.25 * (high - low) else max(dark - 10, 0)
        assert veil(luma) == expected
