"""Two slices meet: the same vehicles are found, and the later one takes over at a quiet moment."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_steps import make_step

from vidtrack.arrays.affine import shift
from vidtrack.run.slices.seam import seam

FPS = 25.0


def drive(ids, frames, first_index=0, off=(0.0, 0.0), lanes=None):
    """Steps of vehicles side by side; `first_index` is taken off the frame numbers."""
    lanes = range(len(ids)) if lanes is None else lanes
    rows = [
        [(i, "c", 4.0 * k + off[0], 40.0 * lane + off[1]) for i, lane in zip(ids, lanes, strict=True)] for k in frames
    ]
    steps = [make_step(k, each, FPS) for k, each in zip(frames, rows, strict=True)]
    return [replace(step, index=step.index - first_index) for step in steps]


def test_vehicles_keep_their_identity_and_frames_their_number():
    found = seam(drive([3, 7, 9], range(100, 150)), drive([9, 0, 4], range(90, 140), 60), 4.5, FPS)
    assert dict(zip(found.left.tolist(), found.right.tolist(), strict=True)) == {3: 9, 7: 0, 9: 4}
    assert (found.shift, found.plane) == (60, None)
    assert 100 / FPS <= found.time_s <= 139 / FPS


def test_what_only_one_slice_has_stays_alone():
    found = seam(drive([1, 2], range(50)), drive([5], range(50), lanes=[1]), 1.0, FPS)
    assert (found.left.tolist(), found.right.tolist()) == ([2], [5])


def test_the_seam_lies_where_no_vehicle_is():
    left, right = (drive([k], range(50)) for k in (0, 1))
    for steps in (left, right):
        steps[20:23] = [make_step(k, [], FPS) for k in range(20, 23)]
    assert seam(left, right, 0.0, FPS).time_s == pytest.approx(22 / FPS)


def test_slices_that_share_no_frame_go_on_at_the_nominal_rate():
    found = seam(drive([1], range(10)), drive([1], range(12, 20), 12), 0.44, FPS)
    assert (found.shift, found.time_s, len(found.left)) == (12, 0.44, 0)


def test_a_camera_that_moved_between_the_slices_is_taken_out():
    """The later slice's scene is its own first picture, 30 px to the right of the earlier one's."""
    left = [replace(step, motion=shift(-30.0, 0.0)) for step in drive([4], range(50))]
    right = drive([8], range(50), off=(-30.0, 0.0))
    found = seam(left, right, 1.0, FPS)
    assert (found.left.tolist(), found.right.tolist()) == ([4], [8])
    assert np.allclose(found.plane, shift(30.0, 0.0))
