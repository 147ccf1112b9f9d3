"""The errors that tables state of vehicles in the picture."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_steps import make_step

from vidtrack.output.stated import all_stated, stated
from vidtrack.scan import Scan

ROWS = {"own": (1, "c", 100.0, 50.0), "shared": (2, "m", 60.0, 60.0), "coasting": (3, "o", 100.0, 50.0)}


def step_of(kind, P, pixel=1.0, rim=1.5, surveyed=(0.0, 0, 200, 100), side=(23.0, 13.0), more=(0, 0), off=(0, 0)):
    """A step with one track of a covariance, whose box is `side` wide and high about its position.

    more, off  (2,) by how much the blob's box is larger than the track's, and where its middle is from the track's
    """
    step = make_step(0, [ROWS[kind]])
    xy = step.tracks.xy[0]
    box = np.array([[*(xy - np.divide(side, 2) + 0.5), *side]])  # a pixel's position is its middle
    group = np.array([1 if kind == "shared" else -1])
    taken = np.array([-1 if kind == "coasting" else 0])
    seen = np.add(side, more)
    blob = np.concatenate([np.subtract(off, seen / 2) + 0.5, seen])[None]
    scan = Scan(0.0, xy[None], np.eye(2), box=blob, pixel=pixel, rim=rim, surveyed=np.array(surveyed))
    return replace(step, scan=scan, tracks=replace(step.tracks, P=P[None], box=box, group=group, measurement=taken))


def position(step):
    return stated(step).tracks.xy_cov[0]


def test_measurements_without_outlines_keep_the_filter_s_errors():
    step = step_of("own", 4 * np.eye(4), rim=0.0)
    assert stated(step) is step


def test_a_blob_of_its_own_limits_the_error_whatever_the_filter_says():
    unsure, sure = position(step_of("own", 1e6 * np.eye(4))), position(step_of("own", 1e-6 * np.eye(4)))
    share = 0.04 * np.sqrt(200) / 22  # sides of 20 and 10 px within the rim
    lasting = np.array([400.0, 100.0]) / 12 * (share**2 + (15 / 200) ** 2)
    np.testing.assert_allclose(np.diag(sure), lasting, rtol=1e-3)
    np.testing.assert_allclose(np.diag(unsure), lasting + 0.15**2, rtol=1e-3)


def test_a_coasting_track_has_the_filter_s_error_and_that_of_its_outline():
    P = np.diag([9.0, 1, 4, 1])
    coasting, sure = position(step_of("coasting", P)), position(step_of("own", 1e-9 * np.eye(4)))
    np.testing.assert_allclose(np.diag(coasting), [9 + sure[0, 0], 4 + sure[1, 1]], rtol=1e-6)


def outline():
    """Variances of an outline that is wrong for long."""
    return np.diag(position(step_of("own", 1e-12 * np.eye(4))))


def test_edges_measure_a_track_on_a_shared_blob():
    found = np.diag(position(step_of("shared", 1e6 * np.eye(4)))) - outline()
    assert found == pytest.approx([1.0**2 + 0.6**2, 0.5**2 + 0.6**2], rel=1e-4)


@pytest.mark.parametrize(("more", "off"), [((-6, 0), (0, 0)), ((3, -4), (0, 0)), ((0, 0), (2, -1)), ((-6, 2), (3, 1))])
def test_a_blob_that_is_not_the_vehicle_s_outline_makes_its_place_uncertain(more, off):
    by = np.diag(position(step_of("own", 1e-12 * np.eye(4), more=more, off=off))) - outline()
    assert by == pytest.approx((np.square(more) + np.square(off)) / 12, abs=1e-9)


def test_a_shared_blob_smaller_than_the_vehicle_lacks_an_end_of_it():
    def by(more):
        return np.diag(position(step_of("shared", 1e-12 * np.eye(4), more=more))) - outline()

    assert by((-8.0, 30.0)) == pytest.approx([16.0, 0.0], abs=1e-9)
    assert by((20.0, 30.0)) == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("kind", sorted(ROWS))
@pytest.mark.parametrize("by", [(6.0, -3.0), (0.0, 1.5)])
def test_the_middle_of_the_box_is_as_likely_as_the_position(kind, by):
    step = step_of(kind, 1e-12 * np.eye(4))
    moved = moved_boxes(step, by)
    assert np.diag(position(moved) - position(step)) == pytest.approx(np.square(by) / 2, abs=1e-9)


def moved_boxes(step, by):
    """The step with the boxes of track and blob moved away from the position."""
    by = np.array([*by, 0, 0])
    return replace(
        step,
        tracks=replace(step.tracks, box=step.tracks.box + by),
        scan=replace(step.scan, box=step.scan.box + by),
    )


@pytest.mark.parametrize("kind", sorted(ROWS))
@pytest.mark.parametrize("known", [np.zeros(4), np.array([1.0, 1, 0, 1]), np.array([1.0, 0, -1, 0])])
def test_a_filter_that_is_certain_of_something_is_no_error(kind, known):
    P = np.outer(known, known)
    found = stated(step_of(kind, P)).tracks.P[0]
    assert np.isfinite(found).all()
    assert np.linalg.eigvalsh(found).min() > -1e-9
    assert np.diag(found)[[0, 2]] == pytest.approx(np.diag(position(step_of(kind, P + 1e-9 * np.eye(4)))), rel=1e-3)


@pytest.mark.parametrize(
    ("surveyed", "more"),
    [((89.0, 0, 200, 100), [0, 1.3]), ((0, 44, 200, 100), [2.6, 0]), ((89, 44, 200, 100), [2.6, 1.3])],
)
def test_a_box_that_the_border_cuts_is_less_certain_along_it(surveyed, more):
    P = np.eye(4)
    by = np.diag(position(step_of("own", P, surveyed=surveyed)) - position(step_of("own", P)))
    assert np.sqrt(np.maximum(by, 0)) == pytest.approx(more, abs=1e-6)


@pytest.mark.parametrize(
    ("left", "off", "least"),
    [(89.5, (2, 4), [2, 0]), (89.5, (-1.5, 4), [1.5, 0]), (0.0, (2, 4), [0, 0]), (89.5, (0.1, 0), [0, 0])],
    ids=["cut", "the other way", "not cut", "less than the other errors"],
)
def test_what_the_border_cuts_is_off_the_middle_of_its_box(left, off, least):
    step = step_of("own", np.diag([0.04, 1, 0.04, 1]), surveyed=(left, 0, 200, 100))
    expected = np.maximum(np.diag(position(step)) + np.square(off) / 2, np.square(least))
    assert np.diag(position(moved_boxes(step, off))) == pytest.approx(expected, rel=1e-9)


def test_all_errors_of_a_small_blob_scale_with_the_processed_pixel():
    P = np.diag([4.0, 1, 4, 1])
    fine = position(step_of("own", P))
    scene = (0.0, 0, 2000, 1000)
    coarse = position(step_of("own", 9 * P, pixel=3.0, rim=4.5, side=(69.0, 39.0), surveyed=scene))
    np.testing.assert_allclose(coarse, 9 * fine, rtol=1e-9)


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(sorted(ROWS)))
def test_what_is_stated_is_a_covariance_with_the_filter_s_of_velocities(seed, kind):
    root = np.random.default_rng(seed).normal(size=(4, 4))
    P = root @ root.T + 1e-3 * np.eye(4)
    found = stated(step_of(kind, P)).tracks
    assert np.linalg.eigvalsh(found.P[0]).min() > 0
    velocity = np.ix_(found.velocity, found.velocity)
    np.testing.assert_allclose(found.P[0][velocity], P[velocity], rtol=1e-6)


def test_steps_together_are_stated_as_each_alone():
    P = np.diag([9.0, 1, 4, 1])
    alike = [step_of("own", P), step_of("coasting", 2 * P), step_of("shared", 3 * P)]
    others = [
        step_of("own", P, rim=0.0),
        step_of("own", P, pixel=2.0),
        step_of("own", P, surveyed=(89.0, 44, 200, 100)),
    ]
    steps = [*alike, *others, *alike]
    for together, alone in zip(all_stated(steps), map(stated, steps), strict=True):
        np.testing.assert_array_equal(together.tracks.P, alone.tracks.P)
