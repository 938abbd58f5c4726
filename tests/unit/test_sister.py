"""A sister's calibration as the prior of the next vehicle of her model."""

from dataclasses import replace

import numpy as np
import pytest
from support.calibrated import calibration_file
from support.half_car_road import VAN, taught_by
from support.known_runs import SIBLING, calibrated_on_loads, known_run

from gateway.calibration.fit_of_drives import SPRINGS_FROM_PRIORS
from gateway.calibration.sister import require_alike, sister_in
from gateway.errors import NoSisterError
from gateway.model.table import INDEX
from gateway.model.vehicle_model import VehicleModel


@pytest.fixture(scope="module")
def sister() -> VehicleModel:
    return calibrated_on_loads(seed=1)


def test_one_empty_drive_weighs_like_the_sister(sister: VehicleModel) -> None:
    empty = known_run(1, 0.0, None, seed=7, car=SIBLING)
    fitted, alone = taught_by([empty], VAN, sister), taught_by([empty])
    springs = [INDEX[f"spring_{end}_npm"] for end in ("front", "rear")]
    std, std_alone = np.sqrt(np.diag(fitted.covariance)), np.sqrt(np.diag(alone.covariance))
    assert np.all(std[springs] < 0.6 * std_alone[springs])
    assert fitted.payload_seen_kg == pytest.approx(sister.payload_seen_kg, abs=5.0)
    assert SPRINGS_FROM_PRIORS in alone.warnings
    assert SPRINGS_FROM_PRIORS not in fitted.warnings


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"wheelbase_m": 1.1 * VAN.wheelbase_m}, "another model"), ({"empty_mass_kg": 1.5 * VAN.empty_mass_kg}, "body")],
)
def test_a_vehicle_of_another_model_is_refused(changes: dict[str, float], why: str) -> None:
    with pytest.raises(NoSisterError, match=why):
        require_alike(VAN, replace(VAN, **changes))


def test_a_calibration_of_the_ratio_index_alone_is_no_sister() -> None:
    with pytest.raises(NoSisterError, match="calibrate it again without --estimator ratio_index"):
        sister_in(calibration_file())
