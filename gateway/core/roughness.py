"""How rough the road under a batch is, as this vehicle feels it."""

import math
from typing import Final

import numpy as np

from gateway.records import Spectra

BAND_HZ: Final = (1.0, 15.0)
REFERENCE_SPEED_MPS: Final = 80.0 / 3.6


def roughness_mps2(spectra: Spectra | None, mean_speed_mps: float) -> float:
    """Root mean square of the vertical acceleration within BAND_HZ, in m/s2, brought to 80 km/h. NaN where unknown.

    A road of ISO 8608 has a displacement density that falls with the square of wavenumber; met at speed v
    its power at every frequency grows in proportion to v. Divided by that, the acceleration tells road
    from speed: sqrt(integral S_aa df) sqrt(v_ref / v). It is this vehicle's own measure, at its sensor.
    """
    if spectra is None or not mean_speed_mps > 0.0 or len(spectra.freq_hz) < 2:
        return math.nan
    inside = (spectra.freq_hz >= BAND_HZ[0]) & (spectra.freq_hz <= BAND_HZ[1])
    step_hz = float(spectra.freq_hz[1] - spectra.freq_hz[0])
    power = float(np.sum(spectra.vertical_acceleration[inside] ** 2)) * step_hz
    return math.sqrt(power * REFERENCE_SPEED_MPS / mean_speed_mps)
