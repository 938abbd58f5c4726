"""From batch to answer or reason, and the error table (12) against numbers worked out by hand."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.drives import T0_NS, drive
from support.paper_van import paper_van

from gateway.calibration.judgement.evaluation import Comparison, Judged, error_table, errors_of, judge
from gateway.calibration.stated_drive import known_drive
from gateway.cli.evaluate import text_of
from gateway.core.batch import BatchWindow, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.core.weights.on_the_road import Unsprung, weighed
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.estimates.posterior import exactly
from gateway.records import Batch, Why
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate

VAN = paper_van(payload_range_kg=(0.0, 400.0), unsprung_front_kg=60.0, unsprung_rear_kg=100.0)
BATCH = build_batch(drive(100.0), BatchWindow(T0_NS, T0_NS + 100_000_000_000, T0_NS), BatchSettings(window_s=100.0), {})


def judged(
    true_kg: float, found_kg: float | None, true_pct: float = 50.0, found_pct: float = 50.0, run: int = 1
) -> Judged:
    told = Estimate(0, 1, "ratio_index", rejected=(Why.TOO_SLOW,))
    if found_kg is not None:
        payload = Quantity(found_kg, interval95=(found_kg - 10.0, found_kg + 10.0))
        front_share = Quantity(found_pct, interval95=(found_pct - 1.0, found_pct + 1.0))
        told = replace(told, rejected=(), payload=payload, front_share=front_share)
    return Judged(known_drive(run, f"{run}.log", true_kg, true_pct, ()), told)


@pytest.mark.parametrize(
    ("true", "is_covered"), [(89.9, False), (90.0, True), (110.0, True), (110.1, False), (float("nan"), None)]
)
def test_an_interval_holds_the_truth_between_its_ends(true: float, is_covered: bool | None) -> None:
    assert Comparison(true, 100.0, 90.0, 110.0).is_covered() is is_covered
    assert Comparison(true, 100.0, float("nan"), float("nan")).is_covered() is None


def test_error_table_by_hand() -> None:
    rows = [judged(100.0, 108.0, 48.0, 48.5), judged(300.0, 280.0, 50.0, 48.0), judged(0.0, None, 50.0)]
    errors = error_table(rows, VAN, "ratio_index").errors
    assert (errors.n_batches, errors.n_rejected) == (3, 1)
    assert errors.rejected_by_reason == {"too_slow": 1}
    payload, share = errors.payload, errors.front_share
    # errors +8 and -20 kg of a range of 400 kg: +2 and -5 %
    assert payload.mean_abs_pct == pytest.approx(3.5)
    assert payload.bias_pct == pytest.approx(-1.5)
    assert payload.std_pct == pytest.approx(3.5)
    assert payload.max_abs_pct == pytest.approx(5.0)
    assert payload.mean_abs == pytest.approx(14.0)
    assert payload.coverage95 == pytest.approx(0.5)
    assert payload.mean_abs_pct_with_misses == pytest.approx((2.0 + 5.0 + 50.0) / 3.0)  # the miss says 200 kg
    assert payload.mean_abs_pct_of_gross == pytest.approx(50.0 * (8.0 / 1500.0 + 20.0 / 1700.0))
    assert payload.half_width_pct == pytest.approx(2.5)
    assert payload.interval_score_pct == pytest.approx(5.0 + 40.0 * 2.5 / 2.0)  # 300 kg lie 10 kg above 290
    # errors +0.5 and -2 points of a range of 20; the miss says 50 where 50 is true
    assert share.mean_abs_pct == pytest.approx(6.25)
    assert share.mean_abs == pytest.approx(1.25)
    assert share.mean_abs_pct_with_misses == pytest.approx(12.5 / 3.0)
    assert share.coverage95 == pytest.approx(0.5)


def test_pieces_at_the_end_of_a_run_are_no_batches() -> None:
    piece = replace(judged(0.0, None), estimate=Estimate(0, 1, "x", rejected=(Why.TOO_SHORT, Why.TOO_SLOW)))
    table = error_table([judged(100.0, 100.0), piece], VAN, "ratio_index")
    assert (table.errors.n_batches, table.errors.n_rejected, len(table.judged)) == (1, 0, 2)
    assert table.errors.payload.mean_abs_pct_with_misses == 0.0


def test_every_run_has_figures_of_its_own() -> None:
    first = [judged(100.0, 108.0), judged(100.0, 96.0)]
    second = [judged(300.0, 280.0, run=2), judged(300.0, None, run=2)]
    runs = error_table([*first, *second], VAN, "ratio_index").to_json()["runs"]
    assert [(run["run"], run["log"], run["true_payload_kg"]) for run in runs] == [(1, "1.log", 100), (2, "2.log", 300)]
    assert [(run["n_batches"], run["n_rejected"]) for run in runs] == [(2, 0), (2, 1)]
    assert [run["payload"]["bias_kg"] for run in runs] == pytest.approx([2.0, -20.0])
    assert [run["payload"]["max_abs_kg"] for run in runs] == pytest.approx([8.0, 20.0])
    assert runs[1]["rejected_by_reason"] == {"too_slow": 1}


def test_figures_without_answers_are_null() -> None:
    table = errors_of([judged(100.0, None)], VAN).payload.to_json()
    assert table.pop("mean_abs_pct_with_misses") == pytest.approx(25.0)
    assert set(table.values()) == {None}
    assert errors_of([], VAN).payload.mean_abs_pct_with_misses is None


ROLLING = replace(VAN, track_width_m=1.5)


def placed(true_m: float, found_m: float, half_m: float = 0.01, payload_kg: float = 200.0) -> Judged:
    """A load told right but for its place beside the centre line."""
    told = judged(payload_kg, payload_kg)
    cg_left = Quantity(found_m, half_m / 2.0, (found_m - half_m, found_m + half_m))
    posterior = exactly(payload_kg, 50.0, found_m)
    estimate = weighed(replace(told.estimate, cg_left=cg_left, roll_share_front=0.6, posterior=posterior), ROLLING)
    return replace(told, estimate=estimate, cg_left_m=true_m)


def test_sideways_errors_by_hand() -> None:
    errors = error_table([placed(0.05, 0.056), placed(-0.03, -0.05), placed(np.nan, 0.2)], ROLLING, "x").errors
    assert errors.cg_left is not None
    told = asdict(errors.cg_left)
    expected = {"mean_abs_m": 0.013, "bias_m": -0.007, "std_m": 0.013, "max_abs_m": 0.02, "coverage95": 0.5}
    expected |= {"half_width_m": 0.01, "interval_score_m": 0.02 + 40.0 * 0.01 / 2.0}  # the second lies 10 mm outside
    assert told == pytest.approx(expected)
    # 1440 kg of sprung mass 6 and 20 mm beside: moments of 8.64 and 28.8 kgm over 1.5 m, of which the front takes 0.6
    gross_kg = 1240.0 + 200.0 + 60.0 + 100.0
    off_kg = np.array([0.6, 0.4]) * 1440.0 * np.array([[0.006], [0.02]]) / 1.5
    assert errors.wheels.mean_abs_pct_of_gross == pytest.approx(100.0 * np.mean(off_kg) / gross_kg)
    assert errors.wheels.max_abs_pct_of_gross == pytest.approx(100.0 * np.max(off_kg) / gross_kg)


def test_the_table_has_lateral_errors() -> None:
    shown = text_of(error_table([placed(0.05, 0.056), placed(-0.03, -0.05)], ROLLING, "x")).splitlines()
    assert shown[4:7] == [
        "c.g. left                           -7.0 mm  13.0 mm  20.0 mm     13.0 mm   50.00 %    10.0 mm 220.0 mm",
        "each wheel        0.39 %                               0.72 %      of gross weight",
        "",
    ]
    assert shown[-1] == (
        "   1    200 kg at 50.0 %        2         0            0.00 kg   0.00 kg          0.00 pp   0.00 pp"
    )


def test_wheels_are_judged_by_unsprung_masses_that_calibration_found() -> None:
    unstated = replace(ROLLING, unsprung_front_kg=None, unsprung_rear_kg=None)
    found = Unsprung(Quantity(60.0, 6.0), Quantity(100.0, 8.0), 0.7)  # as VAN states them: the same figures
    stated = [placed(0.05, 0.056), placed(-0.03, -0.05)]
    rows = [replace(one, unsprung=found, estimate=weighed(one.estimate, unstated, found)) for one in stated]
    judged_by_found = errors_of(rows, unstated).wheels
    assert judged_by_found is not None
    assert judged_by_found == errors_of(stated, ROLLING).wheels
    assert errors_of([replace(one, estimate=weighed(one.estimate, unstated)) for one in rows], unstated).wheels is None


def test_without_a_place_that_was_noted_nothing_sideways_is_judged() -> None:
    errors = errors_of([placed(np.nan, 0.01)], ROLLING)
    assert (errors.cg_left, errors.wheels) == (None, None)
    table = error_table([judged(100.0, 100.0)], ROLLING, "x").to_json()
    assert (table["cg_left"], table["wheels"], table["batches"][0]["true_cg_left_m"]) == (None, None, None)


def test_the_truth_beside_the_centre_line_follows_from_where_the_payload_was_noted() -> None:
    calibrated = calibration_file().for_core()
    runs = [
        known_drive(1, "empty.log", 0.0, 50.0, (BATCH,)),
        known_drive(2, "noted.log", 310.0, 50.0, (BATCH,), -0.25),
        known_drive(3, "not_noted.log", 310.0, 50.0, (BATCH,)),
    ]
    truths_m = [one.cg_left_m for one in judge(runs, calibrated, "ratio_index")]
    assert truths_m == pytest.approx([0.0, -0.05, np.nan], nan_ok=True)


def answer(payload_kg: float = 200.0, front_share_pct: float = 48.0, batch: Batch = BATCH) -> Estimate:
    return estimate(batch, calibration_file(payload_kg, front_share_pct).for_core(), "ratio_index")


def test_a_sound_batch_is_answered_with_spread_and_origin() -> None:
    found = answer()
    assert found.rejected == ()
    assert found.payload.number == pytest.approx(200.0)
    assert found.payload.interval95 == pytest.approx((200.0 - 22.6216, 200.0 + 22.6216), abs=1e-3)  # t(9) = 2.26216
    assert found.payload.std == pytest.approx(22.6216 / 1.959964, rel=1e-4)  # the normal error as wide as Student's
    assert found.front_share.number == pytest.approx(48.0)
    assert found.ratio_index_acceleration > 0.0
    assert found.calibration_id == calibration_file().id


@pytest.mark.parametrize(
    ("payload_kg", "front_share_pct", "is_outside"),
    [  # 0..400 kg and 46..50 % seen, a quarter of the span more at either end, half widths 22.6 kg and 1.13 points
        (200.0, 48.0, False),
        (-100.0, 48.0, False),
        (-122.0, 48.0, False),
        (-123.0, 48.0, True),
        (522.0, 48.0, False),
        (523.0, 48.0, True),
        (200.0, 43.9, False),
        (200.0, 43.8, True),
        (200.0, 52.1, False),
        (200.0, 52.2, True),
    ],
)
def test_out_of_range_is_an_interval_wholly_beyond_what_was_seen(
    payload_kg: float, front_share_pct: float, is_outside: bool
) -> None:
    found = answer(payload_kg, front_share_pct)
    assert found.rejected == ((Why.OUT_OF_RANGE,) if is_outside else ())
    assert np.isnan(found.payload.number) == is_outside
    assert (estimate_to_json(found)["front_share_interval95_pct"] is None) == is_outside


@pytest.mark.parametrize("seen_kg", [(0.0, 0.4), (0.0, 190.0)])
@pytest.mark.parametrize(
    ("payload95_kg", "is_refused"),
    [
        ((-1348.0, 218.0), True),  # -565 +- 783 kg says nothing
        ((100.0, 700.0), False),  # wide, but some of it can be
        ((560.0, 620.0), False),  # an overload of a half, which must be reported
        ((780.0, 850.0), True),
        ((-300.0, -200.0), True),
    ],
)
def test_the_model_is_believed_up_to_half_as_much_again_as_the_vehicle_may_carry(
    payload95_kg: tuple[float, float], is_refused: bool, seen_kg: tuple[float, float]
) -> None:
    """It may carry a third of its own mass; what was learnt of light loads alone hides no heavy one."""
    one = CalibratedVehicle("id", VAN, seen_kg, (50.0, 50.1))
    assert one.payload_believed_kg("cross_spectrum") == pytest.approx((-153.45, 767.25))
    assert one.is_out_of_range("cross_spectrum", payload95_kg, (45.0, 50.0)) is is_refused


def test_the_model_is_believed_for_any_load_between_the_axles() -> None:
    one = CalibratedVehicle("id", VAN, (0.0, 190.0), (50.0, 50.1))
    low, high = one.front_share_believed_pct("cross_spectrum") or (np.nan, np.nan)
    for share95_pct, is_outside in (((low, 45.0), False), ((high - 1.0, 99.0), False), ((high + 1.0, 99.0), True)):
        assert one.is_out_of_range("cross_spectrum", (100.0, 150.0), share95_pct) is is_outside
    assert low < 100.0 * VAN.empty_front_share / 1.33 < high


def test_without_calibration_there_are_spectra_and_a_reason() -> None:
    found = estimate(BATCH, None, "cross_spectrum")
    assert found.rejected == (Why.NO_CALIBRATION,)
    assert found.calibration_id is None
    shown = estimate_to_json(found)
    assert shown["payload_kg"] is None
    assert len(shown["spectra"]["freq_hz"]) == len(found.spectra.freq_hz)


def test_a_rejected_batch_keeps_its_reasons() -> None:
    spoiled = replace(BATCH, rejected=(Why.TOO_SLOW,))
    assert answer(batch=spoiled).rejected == (Why.TOO_SLOW,)
    assert estimate(spoiled, None, "ratio_index").rejected == (Why.TOO_SLOW, Why.NO_CALIBRATION)


def test_the_ratio_index_gates_on_speed() -> None:
    ramp = np.linspace(10.0, 20.0, len(BATCH.speed_mps))
    assert answer(batch=replace(BATCH, speed_mps=ramp)).rejected == (Why.SPEED_SPREAD,)
    for speed_mps, rejected in ((12.0, ()), (11.8, (Why.SPEED_UNCALIBRATED,)), (18.5, (Why.SPEED_UNCALIBRATED,))):
        steady = replace(BATCH, speed_mps=np.full(len(BATCH.speed_mps), speed_mps))
        assert answer(batch=steady).rejected == rejected


def test_too_few_segments_between_the_masks_are_no_answer() -> None:
    usable = BATCH.usable & (np.arange(len(BATCH.usable)) % 200 > 0)
    assert answer(batch=replace(BATCH, usable=usable)).rejected == (Why.NOT_ENOUGH_EXCITATION,)
