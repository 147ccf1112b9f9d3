"""Redundant plots become one: the survey's example, chains, angles, boxes, heaps."""

from typing import ClassVar

import numpy as np
import pytest

from vidtrack.associate.redundancy import combined
from vidtrack.estimate.sensor import Position
from vidtrack.scan import Scan


def test_two_reports_of_one_target():
    """SPEC 001, `redundancy`: d2 = 0.4; the surer axis of each counts more."""
    R = np.array([np.diag([1.0, 4.0]), np.diag([4.0, 1.0])])
    scan, part = combined(Scan(0.0, [[10.0, 2.0], [11.0, 3.0]], R))
    np.testing.assert_allclose(scan.z, [[10.2, 2.8]], rtol=1e-12)
    np.testing.assert_allclose(scan.R, [0.8 * np.eye(2)], rtol=1e-12)
    np.testing.assert_array_equal(part, [0, 0])


def test_chains_are_one_and_strangers_stay():
    z = [[0.0, 0.0], [50.0, 0.0], [6.0, 0.0], [3.0, 0.0]]
    scan, part = combined(
        Scan(
            1.0, z, np.eye(2), amplitude=[1.0, 5.0, 3.0, 2.0], score=[0.1, 0.2, 0.3, 0.9], label=[4, 5, 4, 4],
            box=[[-1.0, -1.0, 2.0, 2.0]] * 4,
        )
    )  # fmt: skip
    np.testing.assert_array_equal(part, [0, 1, 0, 0])
    np.testing.assert_allclose(scan.z, [[3.0, 0.0], [50.0, 0.0]])
    np.testing.assert_allclose(scan.R[0], np.eye(2) / 3)
    np.testing.assert_allclose(scan.box, [[-4.0, -1.0, 8.0, 2.0], [-1.0, -1.0, 2.0, 2.0]])
    np.testing.assert_array_equal(scan.amplitude, [3.0, 5.0])
    np.testing.assert_array_equal(scan.score, [0.9, 0.2])
    np.testing.assert_array_equal(scan.label, [4, 5])
    assert scan.t == 1.0


def test_runs_are_not_mixed():
    scan, part = combined(Scan(0.0, np.zeros((4, 2)), np.eye(2), run=[0, 1, 0, 1]))
    np.testing.assert_array_equal(part, [0, 1, 0, 1])
    np.testing.assert_array_equal(scan.run, [0, 1])


def test_angles_meet_across_the_cut():
    class Polar(Position):
        angles: ClassVar[tuple[int, ...]] = (1,)

    R = np.diag([1.0, 0.01])
    scan, _ = combined(Scan(0.0, [[10.0, np.pi - 0.02], [10.0, -np.pi + 0.04]], R, Polar()))
    np.testing.assert_allclose(scan.z, [[10.0, -np.pi + 0.01]])


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_to_combine(count):
    scan, part = combined(Scan(0.0, np.zeros((count, 2)), np.eye(2)))
    assert len(scan) == len(part) == count


def test_a_heap_of_measurements_is_one_sure_measurement():
    scan, part = combined(Scan(0.0, np.full((3000, 2), 7.0), np.eye(2)))
    np.testing.assert_allclose(scan.z, [[7.0, 7.0]])
    np.testing.assert_allclose(scan.R[0], np.eye(2) / 3000)
    assert not part.any()


def test_pairs_are_those_of_the_definition():
    rng = np.random.default_rng(3)
    z, R = rng.uniform(0, 60, (300, 2)), np.eye(2) * rng.uniform(0.2, 2.0, (300, 1, 1))
    _, part = combined(Scan(0.0, z, R), 0.9)
    v = z[:, None] - z
    d2 = np.einsum("abi,abij,abj->ab", v, np.linalg.inv(R[:, None] + R), v)
    label = np.arange(300)
    for _ in range(300):
        label = np.where(d2 <= 4.605170185988092, label, 300).min(axis=1)
    np.testing.assert_array_equal(label[:, None] == label, part[:, None] == part)
