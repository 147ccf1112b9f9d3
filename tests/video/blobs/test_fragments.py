"""Which regions are pieces of one vehicle, and which pixels of a region belong to which vehicle."""

import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.video.blobs.fragments import links, together
from vidtrack.video.blobs.nearest import nearest_box
from vidtrack.video.blobs.regions import Regions, find_regions

CAR, FAR_CAR = (40.0, 20.0), (16.0, 10.0)
NOBODY = np.empty((0, 4))


def grouped(box, predicted=NOBODY, typical=CAR, area=None, gap=0.05, link=None, flake=0.0):
    """Group of each box (R, 4), where it is known that vehicles are as large as `typical`, everywhere or at each box;
    None: it is not.
    """
    box = np.asarray(box, float)
    usual = np.empty((len(box), 2))
    usual[:] = np.nan if typical is None else typical
    area = box[:, 2] * box[:, 3] if area is None else np.asarray(area, float)
    link = np.arange(len(box)) if link is None else np.asarray(link)
    group, count = together(box, area, link, np.asarray(predicted, float), usual, flake, True, 0.7, gap)
    assert sorted(set(group.tolist())) == list(range(count))
    return group.tolist()


@pytest.mark.parametrize("typical", [CAR, None])
def test_pieces_inside_one_predicted_vehicle_are_one(typical):
    pieces = [[10, 10, 30, 20], [41, 10, 9, 20], [200, 100, 8, 8]]
    assert grouped(pieces, [[9, 9, 42, 22]], typical) == [0, 0, 1]
    assert grouped(pieces, [[9, 9, 42, 22]], typical, gap=0.0) == ([0, 0, 1] if typical else [0, 1, 2])


def test_a_flake_is_a_piece_of_nothing():
    car_and_flakes = [[10, 10, 30, 20], [41, 10, 7, 8], [48, 18, 8, 8], [41, 20, 9, 8]]
    within = [[9, 9, 50, 22]]
    assert grouped(car_and_flakes, within, gap=0.5) == [0, 0, 0, 0]
    assert grouped(car_and_flakes, within, gap=0.5, flake=8.0) == [0, 1, 2, 0]
    assert grouped(car_and_flakes, link=[5, 5, 5, 5], flake=8.0) == [0, 1, 2, 0]


@pytest.mark.parametrize("typical", [CAR, None])
def test_two_regions_that_are_each_like_a_vehicle_are_two_whoever_was_predicted(typical):
    assert grouped([[10, 10, 35, 18], [30, 30, 35, 18]], [[8, 8, 60, 42]], typical, gap=0.5) == [0, 1]


def either_order(boxes, typical):
    """Groups of two boxes inside one predicted vehicle, which do not depend on their order."""
    within = [[8, 5, 60, 60]]
    group = grouped(boxes, within, typical, gap=0.5)
    assert grouped(boxes[::-1], within, typical[::-1], gap=0.5) == group
    return group


@pytest.mark.parametrize("left", [50, 52])
def test_a_far_vehicle_beside_a_near_one_is_judged_by_the_size_where_it_stands(left):
    near, far = [10, 40, 40, 20], [left, 30, 14, 10]
    assert either_order([near, far], [CAR, FAR_CAR]) == [0, 1]
    assert either_order([near, far], [CAR, CAR]) == [0, 0]


@pytest.mark.parametrize(
    ("lower", "upper"), [([10, 40, 40, 20], [30, 28, 14, 10]), ([10, 40, 40, 20], [49, 30, 14, 10])]
)
def test_a_roof_above_a_bonnet_is_judged_by_the_size_where_the_bonnet_stands(lower, upper):
    assert either_order([lower, upper], [CAR, FAR_CAR]) == [0, 0]


@given(st.permutations(range(3)))
def test_groups_do_not_depend_on_the_order_where_sizes_differ(order):
    boxes = [[10, 38, 18, 18], [37, 34, 10, 11], [30, 35, 7, 7]]
    typical = [(36.0, 18.0), (25.0, 12.5), (22.0, 11.0)]
    group = grouped([boxes[k] for k in order], [[5, 20, 70, 60]], [typical[k] for k in order], gap=0.3)
    assert [group[order.index(k)] == group[order.index(1)] for k in range(3)] == [False, True, True]


def test_a_small_piece_beside_a_vehicle_belongs_to_it_though_nobody_predicted_it():
    assert grouped([[10, 10, 30, 20], [44, 12, 6, 10]]) == [0, 0]
    assert grouped([[10, 10, 30, 20], [60, 12, 6, 10]]) == [0, 1]  # too far
    assert grouped([[10, 10, 40, 20], [52, 12, 15, 18]]) == [0, 1]  # more than a vehicle
    assert grouped([[10, 10, 30, 20], [44, 12, 6, 10]], typical=None) == [0, 1]


@pytest.mark.parametrize("typical", [CAR, None])
def test_pieces_that_weak_foreground_links_are_one_unless_each_is_a_vehicle(typical):
    pieces = [[10, 10, 30, 6], [20, 18, 12, 4]]
    assert grouped(pieces, typical=None) == [0, 1]
    assert grouped(pieces, typical=typical, link=[0, 0]) == [0, 0]
    assert grouped(pieces, [pieces[0], pieces[1]], typical=None, link=[0, 0]) == [0, 1]
    assert grouped([[10, 10, 35, 18], [50, 10, 35, 18]], typical=typical, link=[0, 0]) == [0, 1]


@pytest.mark.parametrize("typical", [CAR, None])
def test_a_piece_between_two_vehicles_joins_the_nearer_one_and_never_both(typical):
    two, piece = [[10, 10, 35, 18], [30, 34, 35, 18]], [32, 29, 4, 3]
    assert grouped([*two, piece], [[8, 8, 60, 46]], typical, gap=0.5) == [0, 1, 0]
    assert grouped([piece, *two], [[8, 8, 60, 46]], typical, gap=0.5) == [0, 0, 1]


def test_three_pieces_of_one_vehicle_are_one_though_two_of_them_are_large():
    assert grouped([[10, 10, 16, 20], [27, 12, 6, 16], [34, 10, 16, 20]], [[9, 9, 42, 22]]) == [0, 0, 0]


def test_a_row_of_vehicles_that_shreds_link_stays_as_many():
    vehicles = [[50.0 * k, 10, 35, 18] for k in range(60)]
    shreds = [[50.0 * k + 38, 15, 4, 4] for k in range(59)]
    group = grouped([*vehicles, *shreds], link=np.zeros(119, int))
    assert len(set(group[:60])) == 60


def test_a_region_of_two_predicted_vehicles_is_a_piece_of_neither():
    assert grouped([[10, 10, 60, 12], [32, 23, 6, 4]], [[9, 8, 30, 20], [40, 8, 32, 20]], None, gap=0.3) == [0, 1]


@given(st.permutations(range(5)))
def test_the_order_of_regions_does_not_matter(order):
    boxes = np.array([[10, 10, 30, 20], [41, 10, 9, 20], [200, 100, 8, 8], [100, 50, 20, 20], [122, 50, 6, 12]], float)
    group = grouped(boxes[list(order)], [[9, 9, 42, 22]])
    pairs = {frozenset((order[i], order[j])) for i in range(5) for j in range(i) if group[i] == group[j]}
    assert pairs == {frozenset((0, 1)), frozenset((3, 4))}


def test_each_pixel_goes_to_the_nearest_predicted_vehicle():
    inside, box = np.ones((20, 80), np.uint8), np.array([100, 50, 80, 20])
    label, count = nearest_box(inside, box, np.array([[100.0, 50, 40, 20], [140.0, 50, 40, 20]]))
    assert count == 2
    assert (label[:, :40] == 0).all()
    assert (label[:, 40:] == 1).all()


def test_a_large_vehicle_takes_more_of_a_region_than_a_small_one():
    inside, box = np.ones((20, 90), np.uint8), np.array([0, 0, 90, 20])
    label, _ = nearest_box(inside, box, np.array([[0.0, 0, 60, 20], [60.0, 0, 30, 20]]))
    assert abs((label == label[0, 0]).sum() / 20 - 60) <= 1


def test_boxes_that_the_region_does_not_fill_or_that_lie_on_another_have_no_part_in_it():
    inside, box = np.ones((20, 80), np.uint8), np.array([0, 0, 80, 20])
    left, right = [0.0, 0, 40, 20], [40.0, 0, 40, 20]
    assert nearest_box(inside, box, np.array([left, [60.0, 0, 80, 20]]))[1] == 0
    assert nearest_box(inside, box, np.array([left, [5.0, 0, 40, 20]]))[1] == 0
    assert nearest_box(inside, box, np.array([left, [5.0, 0, 40, 20], right]))[1] == 2
    assert nearest_box(inside, box, NOBODY)[1] == 0


@pytest.mark.parametrize("seed", range(5))
def test_regions_in_one_weak_region_are_linked_unless_it_is_much_larger(seed):
    rng = np.random.default_rng(seed)
    speckle = cv2.GaussianBlur(rng.random((60, 80)), (0, 0), 2)
    weak = np.where(speckle > np.quantile(speckle, 0.6), np.uint8(255), np.uint8(0))
    regions = find_regions(np.where(speckle > np.quantile(speckle, 0.8), np.uint8(255), np.uint8(0)), 0)
    link = links(*regions, weak)

    count, inside = cv2.connectedComponents(weak)
    strong, whole = np.zeros(count), np.bincount(inside.ravel())
    for row, start, stop in zip(regions.row, regions.start, regions.stop, strict=True):
        strong[inside[row, start]] += stop - start
    for a, b in itertools.combinations(range(regions.total), 2):
        place = [inside[regions.row[k], regions.start[k]] for k in (np.argmax(regions.label == i) for i in (a, b))]
        together = place[0] == place[1] != 0 and strong[place[0]] > 0.25 * whole[place[0]]
        assert (link[a] == link[b]) == together


def test_what_lies_in_no_weak_region_is_linked_to_nothing():
    regions = Regions(*np.array([[2, 5], [1, 1], [4, 4]], np.int32), np.arange(2), 2)
    assert links(*regions, np.zeros((8, 8), np.uint8)).tolist() == [-1, -2]
