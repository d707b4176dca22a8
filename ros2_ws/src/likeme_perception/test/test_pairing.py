"""Stamps: pairs of images, late frames, new starts."""

from __future__ import annotations

from likeme_perception.pairing import StampOrder, StampPairing

MS = 1_000_000


def test_equal_stamps_pair_in_any_order() -> None:
    pairing = StampPairing[tuple[str, int]](0.016, lambda item: item[1])
    assert pairing.add(0, ('c', 100 * MS)) is None
    assert pairing.add(1, ('d', 100 * MS)) == (('c', 100 * MS), ('d', 100 * MS))
    assert pairing.add(1, ('d', 133 * MS)) is None
    assert pairing.add(0, ('c', 133 * MS)) == (('c', 133 * MS), ('d', 133 * MS))
    assert pairing.unpaired == 0


def test_the_nearest_within_the_tolerance_counts() -> None:
    pairing = StampPairing[int](0.016, lambda stamp: stamp)
    pairing.add(0, 100 * MS)
    pairing.add(0, 133 * MS)
    assert pairing.add(1, 130 * MS) == (133 * MS, 130 * MS)
    assert pairing.unpaired == 1
    assert pairing.add(1, 200 * MS) is None


def test_an_endless_stream_of_single_images_is_not_kept() -> None:
    pairing = StampPairing[int](0.016, lambda stamp: stamp, keep=4)
    assert all(pairing.add(0, k * 33 * MS) is None for k in range(100))
    assert pairing.unpaired == 96


def test_an_older_frame_is_dropped_and_time_goes_on() -> None:
    order = StampOrder()
    assert [order.classify(s * MS) for s in (1000, 1033, 1020, 1033, 1066)] == [
        'new', 'new', 'older', 'older', 'new',
    ]  # fmt: skip


def test_two_jumps_back_by_more_than_a_second_are_a_new_start() -> None:
    order = StampOrder()
    assert [order.classify(s * MS) for s in (9000, 33, 66, 100)] == [
        'new',
        'older',
        'restart',
        'new',
    ]


def test_many_older_frames_in_a_row_are_a_new_start() -> None:
    order = StampOrder(late_frames=30)
    order.classify(900 * MS)
    taken = [order.classify((10 * k + 1) * MS) for k in range(31)]
    assert taken == ['older'] * 29 + ['restart', 'new']


def test_one_stamp_from_the_future_is_dropped_and_a_pause_is_a_new_start() -> None:
    order = StampOrder(ahead=10.0)
    seconds = [1, 2, 3600, 3, 4, 20, 21, 22, 90, 3700, 91, 92]
    assert [order.classify(s * 1000 * MS) for s in seconds] == [
        'new', 'new', 'ahead', 'new', 'new', 'ahead', 'restart', 'new', 'ahead', 'ahead',
        'ahead', 'restart',
    ]  # fmt: skip
