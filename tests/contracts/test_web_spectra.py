"""The spectra of the last batch with the fitted model beside them, over HTTP."""

from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.half_car_road import batch_over_road
from support.web import Client, Gateway

from gateway.calibration.file import load_calibration
from gateway.core.spectrum import spectra_of
from gateway.estimates.as_json import spectra_from_json
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.model.displayed import Fitted, modelled_spectra
from gateway.records import Spectra, Why
from gateway.web.live.board import Board
from gateway.weighing.calibrated import CalibratedVehicle

SPEED_MPS = 14.0


@pytest.fixture(scope="module")
def calibrated() -> CalibratedVehicle:
    return load_calibration(Path(str(files("gateway"))) / "demo" / "paper_van.json").for_core()


@pytest.fixture(scope="module")
def seen() -> Spectra:
    found = spectra_of(batch_over_road(270.0, 47.0, seed=3, speed_mps=SPEED_MPS))
    assert found is not None
    return found


@pytest.fixture(scope="module")
def weighed(calibrated: CalibratedVehicle, seen: Spectra) -> Estimate:
    return Estimate(
        t_start_ns=0,
        t_end_ns=300 * 10**9,
        estimator="cross_spectrum",
        calibration_id=calibrated.id,
        payload=Quantity(270.0),
        front_share=Quantity(47.0),
        mean_speed_mps=SPEED_MPS,
        spectra=seen,
        diagnostics={"damper_front_ratio": 1.02, "delay_s": 0.2, "delay_std_s": 0.004, "payload_mode_hz": 15.0},
    )


@pytest.fixture
def gateway(tmp_path: Path, calibrated: CalibratedVehicle) -> Iterator[Gateway]:
    with Gateway(tmp_path, calibrated=calibrated) as opened:
        yield opened


@pytest.fixture
def board(gateway: Gateway) -> Board:
    return gateway.board


def told(client: Client) -> dict[str, Any]:
    return client.get("/api/v1/spectra/latest").json()


def test_the_model_is_that_of_what_was_weighed(
    client: Client, board: Board, calibrated: CalibratedVehicle, weighed: Estimate, seen: Spectra
) -> None:
    board.publish(weighed)
    answer = told(client)
    assert (answer["estimator"], answer["payload_kg"], answer["front_share_pct"]) == ("cross_spectrum", 270.0, 47.0)
    fitted = Fitted(270.0, 47.0, 0.2, 0.004, damper_front_ratio=1.02, payload_mode_hz=15.0)
    expected = modelled_spectra(seen, calibrated.cross_spectrum, fitted)
    model = spectra_from_json(answer["model"])
    for name in Spectra.__slots__:
        np.testing.assert_allclose(getattr(model, name), getattr(expected, name), rtol=0.01, atol=1e-3, err_msg=name)
    low, high = calibrated.cross_spectrum.band_hz
    assert low <= answer["model"]["freq_hz"][0] < answer["model"]["freq_hz"][-1] <= high


def test_the_next_batch_has_a_model_of_its_own(client: Client, board: Board, weighed: Estimate) -> None:
    board.publish(weighed)
    first = told(client)
    assert told(client) == first
    board.publish(replace(weighed, t_start_ns=weighed.t_end_ns, t_end_ns=2 * weighed.t_end_ns, payload=Quantity(100.0)))
    second = told(client)
    assert second["spectra"] == first["spectra"]
    assert second["model"]["pitch_rate_radps_rthz"] != first["model"]["pitch_rate_radps_rthz"]


NO_MODEL = {
    "rejected": {"payload": Quantity(), "front_share": Quantity(), "rejected": (Why.MODEL_MISFIT,)},
    "the other estimator": {"estimator": "ratio_index"},
    "an earlier calibration": {"calibration_id": "sha256:before"},
    "no spectra": {"spectra": None},
}


@pytest.mark.parametrize("case", NO_MODEL)
def test_a_batch_without_a_fit_has_no_model(client: Client, board: Board, weighed: Estimate, case: str) -> None:
    board.publish(replace(weighed, **NO_MODEL[case]))
    answer = told(client)
    assert answer["model"] is None
    assert (answer["spectra"] is None) == (case == "no spectra")


def test_a_sensor_that_stands_still_has_no_model(
    client: Client, board: Board, weighed: Estimate, seen: Spectra
) -> None:
    still = replace(seen, pitch_rate=0.0 * seen.pitch_rate, coherence=np.full(len(seen.freq_hz), np.nan))
    board.publish(replace(weighed, spectra=still))
    answer = told(client)
    assert answer["model"] is None
    assert set(answer["spectra"]["coherence"]) == {None}


def test_fits_without_delays_use_the_delay_at_mean_speed(client: Client, board: Board, weighed: Estimate) -> None:
    """As batches tell that were weighed before delays were told."""
    board.publish(replace(weighed, diagnostics={"delay_s": 2.8 / SPEED_MPS}))
    with_delay = told(client)["model"]
    board.publish(replace(weighed, diagnostics={}, t_end_ns=2 * weighed.t_end_ns))
    assert told(client)["model"] == with_delay
