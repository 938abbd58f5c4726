"""What one more known load would do for the ratio index: the leverage of its regressors.

The spread of a predicted load is  s sqrt(1 + x' G^-1 x)  with G = X'X over the batches calibrated and x the
regressors at the load's indexes. The calibrated half-car says which indexes a load not yet driven would
show; a run of n batches adds n x x' to G.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.calibration.plan.loads import PlacedLoad
from gateway.core.cross_spectrum.ideal_drive import Drive, expected_of, steady_spectra
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.measured import Reading
from gateway.core.cross_spectrum.parameters import Ground
from gateway.core.ratio_index.index import UPPER_LIMIT_HZ, Band, RatioIndexCalibration, ratio_index
from gateway.core.ratio_index.regression import RegressionModel, scaled_columns
from gateway.core.vehicle import Vehicle
from gateway.records import F64

LOWEST_HZ: Final = 0.5  # below every band, above where a road's spectrum has no end
INDEX_DRIVE_S: Final = 300.0


@dataclass(frozen=True, slots=True)
class IndexSpread:
    """Root mean square spread of an answer over the loads a vehicle carries; None where there is no model."""

    payload_std_kg: float | None
    front_share_std_pct: float | None


@dataclass(frozen=True, slots=True)
class IndexDesign:
    """The calibrated ratio index of a vehicle whose half-car has the parameters theta (p,)."""

    calibration: RatioIndexCalibration
    vehicle: Vehicle
    theta: F64
    speed_mps: float
    targets: tuple[PlacedLoad, ...]

    def indexes(self, load: PlacedLoad) -> tuple[float, float]:
        """R_a and R_g that this load would show on average; NaN without that pair of bands."""
        ground = Ground(
            self.vehicle.empty_mass_kg, self.vehicle.empty_front_share_pct / 100.0, self.vehicle.wheelbase_m
        )
        reading = Reading(self.vehicle.wheelbase_m, (LOWEST_HZ, UPPER_LIMIT_HZ), self.calibration.n_segment)
        point = Point(self.theta, load.payload_kg, load.front_share_pct / 100.0)
        spectra = expected_of(steady_spectra(reading, Drive(INDEX_DRIVE_S, self.speed_mps)), point, ground)
        freq_hz = spectra.freq_hz[1:-1]
        return (
            self._index(freq_hz, spectra.acceleration[0], self.calibration.acceleration_bands),
            self._index(freq_hz, spectra.pitch_rate[0], self.calibration.pitch_rate_bands),
        )

    def spread(self, driven: tuple[PlacedLoad, ...] = (), n_batches: int = 2) -> IndexSpread:
        """Now, or after ``driven`` runs more of ``n_batches`` each."""
        return IndexSpread(
            self._model_spread(self.calibration.payload, driven, n_batches),
            self._model_spread(self.calibration.front_share, driven, n_batches),
        )

    def _index(self, freq_hz: F64, power: F64, bands: tuple[Band, Band] | None) -> float:
        if bands is None:
            return float("nan")
        kind = self.calibration.spectrum
        return ratio_index(freq_hz, np.sqrt(power) if kind == "amplitude" else power, bands, kind)

    def _model_spread(
        self, model: RegressionModel | None, driven: tuple[PlacedLoad, ...], n_batches: int
    ) -> float | None:
        if model is None:
            return None
        gram = np.linalg.pinv(model.gram_inverse)
        if driven:
            added = self._columns(model, driven)
            gram = gram + n_batches * added.T @ added
        rows = self._columns(model, self.targets)
        leverage = np.einsum("ti,ij,tj->t", rows, np.linalg.pinv(gram), rows)
        return model.residual_std * float(np.sqrt(np.mean(1.0 + leverage)))

    def _columns(self, model: RegressionModel, loads: tuple[PlacedLoad, ...]) -> F64:
        indexes = np.array([self.indexes(load) for load in loads])
        return scaled_columns(model.terms, indexes[:, 0], indexes[:, 1], model.lows, model.highs)
