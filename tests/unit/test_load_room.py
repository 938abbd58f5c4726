"""How much more may be loaded, and into which half of the loading area: cases computed by hand, and no limit passed."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.cab import VAN as BENCH_VAN
from support.cab import aboard

from gateway.core.vehicle import Vehicle
from gateway.core.weights.room import NOTHING, Halves, LoadingArea, LoadRoom, Spare, room_of
from gateway.estimates.batch_estimate import Weight, Weights

VAN = BENCH_VAN.vehicle
AREA = LoadingArea(0.5, 1.0)  # from the middle between the axles to the rear axle
INSIDE = st.floats(0.0, 1.0)
SPARES = st.floats(1.0, 900.0) | st.just(math.inf)


def found(weights: Weights, vehicle: Vehicle = VAN) -> LoadRoom:
    room = room_of(weights, vehicle)
    assert room is not None
    return room


@pytest.mark.parametrize(
    ("spare", "halves"),
    [
        # gross alone: as even as possible
        (Spare(gross_kg=300.0), Halves(150.0, 150.0)),
        # the rear axle takes at most 3/4 of the front half's load and all of the rear half's: 180 / 0.75 in front
        (Spare(gross_kg=353.0, rear_axle_kg=180.0), Halves(240.0, 0.0)),
        # the front axle takes at most 1/2 of the front half's load and 1/4 of the rear half's: 60 / 0.25 in the rear
        (Spare(gross_kg=353.0, front_axle_kg=60.0), Halves(0.0, 240.0)),
        # both axles: x / 2 + y / 4 = 100 and 3 x / 4 + y = 250 cross at x = 120, y = 160
        (Spare(gross_kg=353.0, front_axle_kg=100.0, rear_axle_kg=250.0), Halves(120.0, 160.0)),
        # the gross weight is reached first; 0.75 x + (300 - x) <= 280 needs at least 80 in front, so half each is right
        (Spare(gross_kg=300.0, rear_axle_kg=280.0), Halves(150.0, 150.0)),
        # the same with 240: at least 240 in front
        (Spare(gross_kg=300.0, rear_axle_kg=240.0), Halves(240.0, 60.0)),
        (Spare(gross_kg=-5.0, rear_axle_kg=240.0), NOTHING),
        (Spare(), NOTHING),
    ],
)
def test_the_largest_load_follows_from_the_levers_of_both_halves(spare: Spare, halves: Halves) -> None:
    most = AREA.most(spare)
    assert (most.front_kg, most.rear_kg) == pytest.approx((halves.front_kg, halves.rear_kg))


def test_load_in_one_place_is_limited_by_the_tightest_axle_at_its_worst_place() -> None:
    assert AREA.anywhere_kg(Spare(353.0, 100.0, 180.0)) == 180.0  # all over the rear axle
    assert AREA.anywhere_kg(Spare(353.0, 60.0, 180.0)) == 120.0  # in front it is half on the front axle
    assert AREA.anywhere_kg(Spare(100.0, 60.0, 180.0)) == 100.0
    assert AREA.anywhere_kg(Spare(100.0, -60.0, 180.0)) == -60.0


@pytest.mark.parametrize(
    ("spare", "halves"),
    [
        (Spare(gross_kg=-40.0), Halves(20.0, 20.0)),
        # a piece of the rear half takes at least 3/4 of its weight off the rear axle
        (Spare(gross_kg=100.0, rear_axle_kg=-30.0), Halves(0.0, 40.0)),
        # a piece of the front half takes at least 1/4 of its weight off the front axle
        (Spare(gross_kg=100.0, front_axle_kg=-10.0), Halves(40.0, 0.0)),
        (Spare(gross_kg=100.0), NOTHING),
    ],
)
def test_the_least_removal_follows_from_the_levers_of_both_halves(spare: Spare, halves: Halves) -> None:
    out = AREA.least_to_take_out(spare)
    assert out is not None
    assert out.kg == pytest.approx(halves.kg)
    if spare.gross_kg > 0.0:
        assert (out.front_kg, out.rear_kg) == pytest.approx((halves.front_kg, halves.rear_kg))


def test_no_unloading_helps_the_front_axle_if_the_whole_area_is_behind_the_rear_axle() -> None:
    assert LoadingArea(1.1, 1.6).least_to_take_out(Spare(front_axle_kg=-10.0)) is None


@given(
    SPARES, SPARES, SPARES, st.floats(-0.2, 0.9), st.floats(0.2, 1.5), st.lists(st.tuples(INSIDE, INSIDE), max_size=6)
)
def test_no_limit_is_passed_for_any_place_in_the_half(
    gross_kg: float, front_kg: float, rear_kg: float, begin: float, length: float, pieces: list[tuple[float, float]]
) -> None:
    """The load of each half is cut into pieces at any places in that half."""
    area, spare = LoadingArea(begin, begin + length), Spare(gross_kg, front_kg, rear_kg)
    most = area.most(spare)
    if math.isinf(spare.least_kg):
        assert most == NOTHING
        return
    assert min(most.front_kg, most.rear_kg) >= 0.0
    assert most.kg >= area.anywhere_kg(spare) * (1.0 - 1e-9) - 1e-6
    cuts = [0.0, *sorted(cut for cut, _ in pieces), 1.0]
    places = [place for _, place in pieces] + [0.0]
    parts = [(after - before, place) for before, after, place in zip(cuts[:-1], cuts[1:], places, strict=True)]
    half = length / 2.0
    on_rear = sum(
        kg * part * (from_ + place * half)
        for kg, from_ in ((most.front_kg, begin), (most.rear_kg, begin + half))
        for part, place in parts
    )
    assert most.kg <= gross_kg + 1e-6
    assert most.kg - on_rear <= front_kg + 1e-6
    assert on_rear <= rear_kg + 1e-6


@given(st.floats(-300.0, 300.0), st.floats(-100.0, 300.0), st.floats(-100.0, 300.0), INSIDE, INSIDE)
def test_no_limit_is_passed_after_the_advised_removal(
    gross_kg: float, front_kg: float, rear_kg: float, one: float, other: float
) -> None:
    out = AREA.least_to_take_out(Spare(gross_kg, front_kg, rear_kg))
    assert out is not None
    off_rear = out.front_kg * (0.5 + 0.25 * one) + out.rear_kg * (0.75 + 0.25 * other)
    assert gross_kg + out.kg >= -1e-6
    assert front_kg + out.kg - off_rear >= -1e-6
    assert rear_kg + off_rear >= -1e-6


def test_room_is_safe_by_the_unfavourable_ends_and_has_an_interval() -> None:
    room = found(aboard(300.0, 48.0))
    low, high = room.most.interval95
    assert low == pytest.approx(room.safe.kg)
    assert low < room.most.number < high
    assert room.most.std == pytest.approx((high - low) / (2.0 * 1.959964))
    assert room.take_out == NOTHING


def test_an_overload_has_negative_room_and_a_removal() -> None:
    room = found(aboard(620.0, 50.0, std_kg=0.0))  # 2020 kg in all, 1010 on either axle
    assert room.most.number == pytest.approx(-20.0)
    assert room.safe == NOTHING
    assert room.take_out is not None
    assert room.take_out.kg >= 20.0


def test_nothing_is_promised_without_a_limit_or_while_a_limited_axle_is_unknown() -> None:
    unlimited = replace(VAN, gross_limit_kg=None, front_axle_limit_kg=None, rear_axle_limit_kg=None)
    assert room_of(Weights(gross=Weight(1700.0, 6.0, None, None)), unlimited) is None
    known = Weights(gross=Weight(1700.0, 6.0, 2000.0, None, False, (1690.0, 1710.0)))
    assert found(known).safe.kg == pytest.approx(290.0)
    assert found(known).is_anywhere
    assert room_of(replace(known, rear_axle=Weight(limit_kg=1050.0)), VAN) is None


def test_weight_of_unknown_error_counts_as_it_is() -> None:
    assert found(Weights(gross=Weight(1700.0, math.nan, 2000.0, None))).safe.kg == pytest.approx(300.0)


def test_unstated_loading_area_promises_no_more_than_a_usual_one() -> None:
    weights = aboard(300.0, 48.0)
    assert found(weights, replace(VAN, loading_area_m=None)).safe.kg < found(weights).safe.kg


def test_loading_area_that_does_not_rise_is_refused() -> None:
    with pytest.raises(ValueError, match="loading_area_m must rise"):
        replace(VAN, loading_area_m=(2.0, 1.0))
