"""The tare: laws of taking off a zero, and of what may be one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gateway.core.fusion import LoadEpoch, fused, summary
from gateway.core.tare import (
    MOST_FRONT_SHARE_PCT,
    MOST_PAYLOAD_SHARE,
    MOST_STD_SHARE,
    Refusal,
    Tare,
    Weighed,
    Zero,
    remembered,
    tared,
    zero_of,
)
from gateway.core.vehicle import Vehicle
from gateway.errors import TareRefusedError
from gateway.estimate import Epoch, Estimate, Quantity
from gateway.estimate_json import estimate_to_json
from gateway.records import Why

VAN = Vehicle("van", empty_mass_kg=1240.0, wheelbase_m=2.8, empty_front_share_pct=52.0)
MOST_KG = MOST_PAYLOAD_SHARE * VAN.empty_mass_kg

finite = {"allow_nan": False, "allow_infinity": False}
zeros = st.builds(
    Zero,
    payload_kg=st.floats(-200.0, 200.0, **finite),
    payload_std_kg=st.floats(0.0, 50.0, **finite),
    front_share_pct=st.floats(-5.0, 5.0, **finite),
    front_share_std_pct=st.floats(0.0, 3.0, **finite),
)


def batch(
    payload_kg: float, share_pct: float, std_kg: float = 10.0, share_std_pct: float = 0.5, n: int = 0
) -> Estimate:
    return Estimate(
        t_start_ns=n,
        t_end_ns=n + 1,
        estimator="cross_spectrum",
        calibration_id="sha256:ab",
        payload=Quantity(payload_kg, std_kg, (payload_kg - 1.9 * std_kg, payload_kg + 2.3 * std_kg)),
        front_share=Quantity(share_pct, share_std_pct, (share_pct - 1.0, share_pct + 1.0)),
    )


def tare_of(zero: Zero, calibration_id: str = "sha256:ab") -> Tare:
    return Tare("sha256:cd", calibration_id, "cross_spectrum", zero)


batches = st.builds(
    batch,
    payload_kg=st.floats(-100.0, 1000.0, **finite),
    share_pct=st.floats(30.0, 70.0, **finite),
    std_kg=st.floats(0.5, 80.0, **finite),
    share_std_pct=st.floats(0.05, 3.0, **finite),
)


@given(batches, zeros)
def test_the_raw_numbers_ride_along_unchanged(found: Estimate, zero: Zero) -> None:
    shown = tared(found, tare_of(zero))
    assert (shown.tare.raw_payload, shown.tare.raw_front_share) == (found.payload, found.front_share)
    assert shown.tare.payload == Quantity(zero.payload_kg, zero.payload_std_kg)
    assert shown.tare.front_share == Quantity(zero.front_share_pct, zero.front_share_std_pct)
    assert shown.payload.number + zero.payload_kg == pytest.approx(found.payload.number, abs=1e-9)
    record = estimate_to_json(shown)
    assert record["raw_payload_kg"] == pytest.approx(record["payload_kg"] + record["tare_payload_kg"], abs=1e-5)
    assert record["tare_id"] == "sha256:cd"


@given(batches, zeros)
def test_standard_deviations_add_in_quadrature(found: Estimate, zero: Zero) -> None:
    shown = tared(found, tare_of(zero))
    assert shown.payload.std**2 == pytest.approx(found.payload.std**2 + zero.payload_std_kg**2)
    assert shown.front_share.std**2 == pytest.approx(found.front_share.std**2 + zero.front_share_std_pct**2)


@given(batches, zeros)
def test_intervals_move_with_the_number_and_never_narrow(found: Estimate, zero: Zero) -> None:
    shown = tared(found, tare_of(zero))
    for low_high, before, centre, was in (
        (shown.payload.interval95, found.payload.interval95, shown.payload.number, found.payload.number),
        (
            shown.front_share.interval95,
            found.front_share.interval95,
            shown.front_share.number,
            found.front_share.number,
        ),
    ):
        assert centre - low_high[0] >= was - before[0] - 1e-9
        assert low_high[1] - centre >= before[1] - was - 1e-9


@given(batches)
def test_a_zero_known_to_be_nothing_moves_nothing(found: Estimate) -> None:
    shown = tared(found, tare_of(Zero(0.0, 0.0, 0.0, 0.0)))
    correlations = ("correlation", "payload_cg_left_correlation", "front_share_cg_left_correlation")
    same = {name: getattr(found, name) for name in ("payload", "front_share", *correlations)}
    assert replace(shown, tare=None, **same) == found
    for name in correlations:
        assert getattr(shown, name) == pytest.approx(getattr(found, name), nan_ok=True)
    for after, before in ((shown.payload, found.payload), (shown.front_share, found.front_share)):
        assert (after.number, after.std) == (before.number, before.std)
        assert after.interval95 == pytest.approx(before.interval95)


@given(batches, zeros)
def test_without_its_calibration_estimator_or_an_answer_it_does_nothing(found: Estimate, zero: Zero) -> None:
    assert tared(found, None) is found
    assert tared(found, tare_of(zero, calibration_id="sha256:ef")) is found
    other = replace(found, estimator="ratio_index")
    assert tared(other, tare_of(zero)) is other
    rejected = replace(found, rejected=(Why.GAP,))
    assert tared(rejected, tare_of(zero)) is rejected


@given(batches, zeros)
def test_another_tare_is_another_estimate_and_none_is_the_same_as_ever(found: Estimate, zero: Zero) -> None:
    shown = tared(found, tare_of(zero))
    assert shown.id != found.id
    assert tared(found, replace(tare_of(zero), id="sha256:other")).id != shown.id
    assert replace(shown, tare=None).id == found.id


def test_unknown_stays_unknown() -> None:
    half = replace(batch(100.0, math.nan), front_share=Quantity(math.nan))
    shown = tared(half, tare_of(Zero(10.0, 1.0, 1.0, 0.1)))
    assert shown.payload.number == 90.0
    record = estimate_to_json(shown)
    assert record["front_share_pct"] is record["front_share_std_pct"] is record["front_share_interval95_pct"] is None


@given(batches, zeros, st.floats(-0.9, 0.9), st.floats(-0.9, 0.9))
def test_where_the_load_lies_sideways_is_left_as_it_is(
    found: Estimate, zero: Zero, with_payload: float, with_share: float
) -> None:
    """And how its error goes with the others': by their raw deviations, for the zero knows nothing of it."""
    aside = replace(
        found,
        cg_left=Quantity(0.03, 0.006),
        payload_cg_left_correlation=with_payload,
        front_share_cg_left_correlation=with_share,
        epoch=Epoch(found.payload, found.front_share, 1, Quantity(0.03, 0.005)),
    )
    shown = tared(aside, tare_of(zero))
    assert shown.cg_left == aside.cg_left
    assert shown.epoch.cg_left == aside.epoch.cg_left
    assert shown.payload_cg_left_correlation * shown.payload.std == pytest.approx(with_payload * found.payload.std)
    assert shown.front_share_cg_left_correlation * shown.front_share.std == pytest.approx(
        with_share * found.front_share.std
    )


@given(batches, zeros)
def test_the_epoch_is_corrected_as_its_batches_are(found: Estimate, zero: Zero) -> None:
    fields = summary(fused(None, found))
    shown = tared(replace(found, epoch=fields), tare_of(zero))
    assert shown.epoch.payload.number == pytest.approx(shown.payload.number, abs=1e-9)
    assert shown.epoch.payload.std == pytest.approx(shown.payload.std)
    assert shown.epoch.front_share.number == pytest.approx(shown.front_share.number)
    assert shown.epoch.n_batches == 1


def weighed_from(*found: Estimate) -> Weighed:
    epoch: LoadEpoch | None = None
    weighed: Weighed | None = None
    for one in found:
        epoch = fused(epoch, one)
        weighed = remembered(weighed, epoch, one, drive_start_ns=0)
    assert weighed is not None
    return weighed


@given(st.integers(0, 2**32 - 1), st.floats(-40.0, 40.0), st.floats(-2.0, 2.0), st.integers(1, 12))
def test_a_tare_on_an_epoch_of_an_empty_vehicle_moves_its_mean_to_zero(
    seed: int, bias_kg: float, bias_pct: float, n: int
) -> None:
    """Whatever the bias, within the bounds: the fused payload becomes 0 and the fused share the empty one."""
    rng = np.random.default_rng(seed)
    found = [
        batch(bias_kg + 5.0 * e, 52.0 + bias_pct + 0.2 * d, n=i) for i, (e, d) in enumerate(rng.normal(size=(n, 2)))
    ]
    weighed = weighed_from(*found)
    try:
        zero = zero_of(weighed, VAN)
    except TareRefusedError:
        assume(False)
        raise
    corrected = tared(replace(found[-1], epoch=summary(weighed.epoch)), tare_of(zero))
    assert corrected.epoch.payload.number == pytest.approx(0.0, abs=1e-9)
    assert corrected.epoch.front_share.number == pytest.approx(VAN.empty_front_share_pct)
    assert zero.payload_std_kg == pytest.approx(summary(weighed.epoch).payload.std)


def test_it_removes_a_bias_of_the_sensor_from_what_is_weighed_later() -> None:
    """12 batches of the empty vehicle tare away a bias of 25 kg; 2000 loaded ones then average to the load."""
    rng = np.random.default_rng(5)
    bias_kg, load_kg = 25.0, 200.0
    empty = [batch(bias_kg + float(e), 52.0, n=i) for i, e in enumerate(6.0 * rng.normal(size=12))]
    zero = zero_of(weighed_from(*empty), VAN)
    loaded = [tared(batch(load_kg + bias_kg + float(e), 50.0), tare_of(zero)) for e in 6.0 * rng.normal(size=2000)]
    mean_kg = float(np.mean([one.payload.number for one in loaded]))
    assert mean_kg == pytest.approx(load_kg, abs=2.0 * zero.payload_std_kg)
    assert abs(mean_kg - load_kg) < 0.2 * bias_kg


@given(st.floats(-400.0, 400.0), st.floats(-8.0, 8.0), st.floats(0.5, 120.0), st.floats(0.05, 6.0))
def test_beyond_the_bounds_there_is_no_tare(
    payload_kg: float, offset_pct: float, std_kg: float, share_std_pct: float
) -> None:
    weighed = weighed_from(batch(payload_kg, VAN.empty_front_share_pct + offset_pct, std_kg, share_std_pct))
    offset = weighed.epoch.front_share_pct.mean - VAN.empty_front_share_pct
    is_large = abs(payload_kg) > MOST_KG or abs(offset) > MOST_FRONT_SHARE_PCT
    vagueness = max(std_kg / (MOST_STD_SHARE * MOST_KG), share_std_pct / (MOST_STD_SHARE * MOST_FRONT_SHARE_PCT))
    assume(abs(vagueness - 1.0) > 1e-9)  # the epoch keeps inverse variances: the last bit may differ
    is_vague = vagueness > 1.0
    if not is_large and not is_vague:
        zero = zero_of(weighed, VAN)
        assert (zero.payload_kg, zero.payload_std_kg) == (payload_kg, pytest.approx(std_kg))
        return
    with pytest.raises(TareRefusedError) as refused:
        zero_of(weighed, VAN)
    assert refused.value.reason in {Refusal.OFFSET_TOO_LARGE} | ({Refusal.OFFSET_UNCERTAIN} if is_vague else set())


def test_a_weighing_names_its_newest_batches_and_outlives_a_stop() -> None:
    found = [batch(10.0, 52.0, n=i) for i in range(30)]
    weighed = weighed_from(*found)
    assert weighed.n_batches == 30
    assert weighed.batch_ids == tuple(one.id for one in found[-20:])
    assert remembered(weighed, None, found[0], drive_start_ns=9) is weighed
    assert remembered(weighed, weighed.epoch, replace(found[0], rejected=(Why.GAP,)), drive_start_ns=0) is weighed
    anew = fused(None, batch(0.0, 52.0, n=99))
    begun = remembered(weighed, anew, batch(0.0, 52.0, n=99), drive_start_ns=9)
    assert begun is not None
    assert (begun.n_batches, begun.batch_ids, begun.drive_start_ns) == (1, (batch(0.0, 52.0, n=99).id,), 9)
