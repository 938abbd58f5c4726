"""An empty front share that the fitter got wrong: by how much answers move with it, and that intervals say so."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.calibrated import calibration_file
from support.drives import drive
from support.half_car_road import VAN, batch_over_road, weighed

from gateway.calibration.half_car import calibrate_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.core.flow import Flow, Identity
from gateway.core.settings import BatchSettings
from gateway.core.stated_share import measured, told
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.core.weights import place_of
from gateway.estimate import Epoch, Estimate, Quantity

PLACED = ((0.0, None), (270.0, 0.6), (270.0, 2.4), (420.0, 2.0))  # kg, m behind the front axle
OFF_PCT = 1.0


def calibrated_with(vehicle: Vehicle) -> dict[float, tuple[float, float]]:
    """Payload and front share found for drives of true loads, by a calibration that was told ``vehicle``."""
    runs = []
    for i, (kg, place_m) in enumerate(PLACED):
        batches = tuple(batch_over_road(kg, front_share_pct(VAN, kg, place_m), 10 * i + k) for k in range(2))
        runs.append(KnownRun(i, str(i), kg, front_share_pct(vehicle, kg, place_m), batches))
    calibration = calibrate_cross_spectrum(runs, vehicle)
    found = {}
    for kg, place_m in ((0.0, None), (150.0, 1.5), (380.0, 1.8)):
        estimate = weighed(batch_over_road(kg, front_share_pct(VAN, kg, place_m), 77), calibration)
        found[kg] = (estimate.payload.number, estimate.front_share.number)
    return found


def test_a_share_stated_wrong_moves_shares_as_statics_has_it_and_payloads_hardly() -> None:
    right = calibrated_with(VAN)
    wrong = calibrated_with(replace(VAN, empty_front_share_pct=VAN.empty_front_share_pct + OFF_PCT))
    for kg, (payload_kg, share_pct) in right.items():
        assert wrong[kg][0] == pytest.approx(payload_kg, abs=6.0)
        moved_pct = wrong[kg][1] - share_pct
        assert moved_pct == pytest.approx(OFF_PCT * VAN.empty_mass_kg / (VAN.empty_mass_kg + kg), rel=0.15)


def estimate_of(share: Quantity, correlation: float = -0.6) -> Estimate:
    return Estimate(
        0, 1, "cross_spectrum", payload=Quantity.normal(310.0, 12.0), front_share=share, correlation=correlation
    )


@given(std=st.floats(0.01, 5.0), own=st.floats(0.05, 3.0), correlation=st.floats(-0.99, 0.99))
def test_the_interval_widens_by_what_is_stated(std: float, own: float, correlation: float) -> None:
    vehicle = replace(VAN, empty_front_share_std_pct=std)
    before = replace(
        estimate_of(Quantity.normal(49.0, own), correlation), front_share_cg_left_correlation=0.5 * correlation
    )
    shown = told(before, vehicle)
    by_stated = std * VAN.empty_mass_kg / (VAN.empty_mass_kg + 310.0)
    assert shown.front_share.std == pytest.approx(np.hypot(own, by_stated))
    assert np.diff(shown.front_share.interval95)[0] == pytest.approx(2 * 1.959964 * shown.front_share.std)
    covariance = [one.correlation * one.payload.std * one.front_share.std for one in (before, shown)]
    assert covariance[1] == pytest.approx(covariance[0])
    beside = [one.front_share_cg_left_correlation * one.front_share.std for one in (before, shown)]
    assert beside[1] == pytest.approx(beside[0])
    assert (shown.payload, shown.front_share.number) == (before.payload, 49.0)
    back = measured(shown.payload, shown.front_share, shown.correlation, vehicle)
    assert back == (pytest.approx(own, rel=1e-3), pytest.approx(correlation, rel=1e-3))


def test_where_the_load_lies_does_not_hang_on_the_empty_share() -> None:
    """Both shares have the one error."""
    sure, unsure = (replace(VAN, empty_front_share_std_pct=std) for std in (0.01, 2.0))
    before = estimate_of(Quantity.normal(49.0, 0.4))
    places = []
    for vehicle in (sure, unsure):
        shown = told(before, vehicle)
        place = place_of(vehicle, shown.payload, shown.front_share, shown.correlation)
        assert place is not None
        places.append(place)
    assert places[0].std_m == pytest.approx(places[1].std_m, rel=1e-6)


def test_an_epoch_is_no_surer_and_what_is_refused_stays() -> None:
    vehicle = replace(VAN, empty_front_share_std_pct=0.9)
    empty = replace(estimate_of(Quantity.normal(52.0, 0.3)), epoch=Epoch(Quantity(0.0, 5.0), Quantity(52.0, 0.1), 4))
    epoch = told(empty, vehicle).epoch
    assert epoch is not None
    assert epoch.front_share.std == pytest.approx(np.hypot(0.1, 0.9))
    assert epoch.payload.std == 5.0
    refused = empty.refused()
    assert told(replace(refused, rejected=("gap",)), vehicle).front_share.std is refused.front_share.std
    assert told(empty, None) is empty


def test_what_leaves_the_flow_is_as_sure_as_the_empty_share_and_what_is_fused_is_not() -> None:
    calibrated = calibration_file(payload_kg=12.0, front_share_pct=51.0).for_core()
    settings = BatchSettings(window_s=20.0)
    stds, fused = [], []
    for std in (0.01, 0.8):
        vehicle = replace(calibrated.vehicle, empty_front_share_std_pct=std)
        flow = Flow(settings, {}, replace(calibrated, vehicle=vehicle), "ratio_index", Identity())
        stds += [one.front_share.std for one in flow.feed(drive(45.0)) if one.counted][-1:]
        assert flow.weighed is not None
        fused.append(flow.weighed.epoch)
    assert stds[1] > 0.7
    assert stds[1] ** 2 - stds[0] ** 2 == pytest.approx(0.64 - 0.0001, rel=0.05)
    assert fused[0] == fused[1]
