"""The modelled spectra are those of the vehicle: of one whose every number is known, over a random road."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, VAN, batch_over_road, parameters_of

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.displayed import Fitted, modelled_spectra
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.spectrum import spectra_of
from gateway.records import Spectra

SPEED_MPS = 14.0
DELAY_S = VAN.wheelbase_m / SPEED_MPS
LOADED = Fitted(payload_kg=270.0, front_share_pct=47.0, delay_s=DELAY_S)


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    parameters = parameters_of(CAR)
    return CrossSpectrumCalibration(
        empty_mass_kg=VAN.empty_mass_kg,
        empty_front_share_pct=VAN.empty_front_share_pct,
        wheelbase_m=VAN.wheelbase_m,
        band_hz=(1.1, 14.0),
        n_segment=256,
        names=PARAMETERS,
        parameters=parameters,
        covariance=np.zeros((len(parameters), len(parameters))),
        directions=np.zeros((len(PARAMETERS), 0)),
        model_std=(0.0, 0.0, 0.0),
        misfit_limit=2.0,
        acceleration_rms_mps2=1.0,
        pitch_rate_rms_radps=0.05,
        payload_seen_kg=(0.0, 400.0),
        front_share_seen_pct=(40.0, 60.0),
        speed_seen_mps=(5.0, 30.0),
    )


@pytest.fixture(scope="module")
def seen() -> Spectra:
    found = spectra_of(batch_over_road(270.0, 47.0, seed=3, speed_mps=SPEED_MPS, noise=0.0))
    assert found is not None
    return found


def measured(seen: Spectra, modelled: Spectra) -> Spectra:
    """The measured spectra at the modelled frequencies."""
    kept = np.isin(seen.freq_hz, modelled.freq_hz)
    return Spectra(*(getattr(seen, name)[kept] for name in Spectra.__slots__))


def amplitude_misfit(seen: Spectra, modelled: Spectra) -> float:
    beside = measured(seen, modelled)
    logs = [
        np.log(getattr(modelled, sensor) / getattr(beside, sensor))
        for sensor in ("vertical_acceleration", "pitch_rate")
    ]
    return float(np.sqrt(np.mean(np.square(logs))))


def test_it_lies_over_the_spectra_of_the_same_vehicle(seen: Spectra, calibration: CrossSpectrumCalibration) -> None:
    modelled = modelled_spectra(seen, calibration, LOADED)
    beside = measured(seen, modelled)
    assert amplitude_misfit(seen, modelled) < 0.08  # 233 half-overlapping segments scatter by about 5 %
    is_coherent = modelled.coherence > 0.8  # where it is low, the phase is anybody's guess
    assert is_coherent.sum() > 20
    turned = np.angle(np.exp(1j * (modelled.phase_rad - beside.phase_rad)))
    assert np.abs(turned[is_coherent]).max() < 0.2
    assert np.abs(modelled.coherence - beside.coherence).mean() < 0.08


def test_a_payload_on_pallets_is_drawn_as_it_was_found(calibration: CrossSpectrumCalibration) -> None:
    car = replace(CAR, payload_mode_hz=14.0)
    ringing = spectra_of(batch_over_road(270.0, 47.0, seed=3, speed_mps=SPEED_MPS, noise=0.0, car=car))
    assert ringing is not None
    as_found = modelled_spectra(ringing, calibration, replace(LOADED, payload_mode_hz=14.0))
    assert amplitude_misfit(ringing, as_found) < 0.08
    as_calibrated = modelled_spectra(ringing, calibration, LOADED)
    assert amplitude_misfit(ringing, as_calibrated) > 1.1 * amplitude_misfit(ringing, as_found)


@pytest.mark.parametrize(("payload_kg", "front_share_pct"), [(0.0, 52.0), (270.0, 52.0), (420.0, 47.0)])
def test_another_load_lies_beside_them(
    seen: Spectra, calibration: CrossSpectrumCalibration, payload_kg: float, front_share_pct: float
) -> None:
    other = replace(LOADED, payload_kg=payload_kg, front_share_pct=front_share_pct)
    right = amplitude_misfit(seen, modelled_spectra(seen, calibration, LOADED))
    assert amplitude_misfit(seen, modelled_spectra(seen, calibration, other)) > 1.1 * right


def test_what_it_says_it_says_again_of_itself(seen: Spectra, calibration: CrossSpectrumCalibration) -> None:
    """The level is a line through the model's own spectra: nothing is left to move."""
    once = modelled_spectra(seen, calibration, LOADED)
    twice = modelled_spectra(once, calibration, LOADED)
    for name in Spectra.__slots__:
        np.testing.assert_allclose(getattr(twice, name), getattr(once, name), rtol=1e-9, err_msg=name)


@pytest.mark.parametrize("gain", [0.1, 7.0])
def test_a_rougher_road_lifts_both_alike(seen: Spectra, calibration: CrossSpectrumCalibration, gain: float) -> None:
    louder = replace(seen, vertical_acceleration=gain * seen.vertical_acceleration, pitch_rate=gain * seen.pitch_rate)
    one, other = (modelled_spectra(each, calibration, LOADED) for each in (seen, louder))
    np.testing.assert_allclose(other.pitch_rate, gain * one.pitch_rate, rtol=1e-9)
    np.testing.assert_allclose(other.coherence, one.coherence, rtol=1e-12)


def test_varied_speeds_blur_the_wheelbase(seen: Spectra, calibration: CrossSpectrumCalibration) -> None:
    """Speeds that differ fill the notches that one delay cuts, most at high frequencies."""
    steady = modelled_spectra(seen, calibration, LOADED)
    varied = modelled_spectra(seen, calibration, replace(LOADED, delay_std_s=0.2 * DELAY_S))
    is_high = steady.freq_hz > 5.0
    assert np.ptp(np.log(varied.pitch_rate[is_high])) < np.ptp(np.log(steady.pitch_rate[is_high]))


def test_the_delays_of_a_batch_are_those_of_its_speed() -> None:
    batch = batch_over_road(0.0, 52.0, seed=4, duration_s=60.0, speed_mps=SPEED_MPS)
    spectra = cross_spectra_of([batch], Reading(VAN.wheelbase_m, (1.1, 14.0), 256))
    assert spectra is not None
    assert spectra.delay_mean_s == pytest.approx(DELAY_S)
    assert spectra.delay_std_s == pytest.approx(0.0, abs=1e-9)
