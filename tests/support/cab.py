"""A gateway in a cab: a van with limits, loads it may carry, and what became of them."""

from pathlib import Path

import numpy as np

from gateway.core.events.entry import EntryKind
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import weights_of
from gateway.estimates.batch_estimate import Estimate, Weights
from gateway.estimates.posterior import Posterior
from gateway.estimates.quantity import Z95
from gateway.records import iso_utc, json_line
from gateway.status import Standing, State, Status
from gateway.weighing.calibrated import CalibratedVehicle
from support.estimates import make_estimate, posterior_of
from support.web import Gateway

S = 1_000_000_000
BEFORE = Status(
    version="1.2.3", state=State.ESTIMATING, uptime_s=5.0, vehicle_id="van-17", calibration_id="sha256:ab",
    standing=Standing(),
)  # fmt: skip
VAN = CalibratedVehicle(
    id="sha256:ab",
    vehicle=Vehicle(
        name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0,
        unsprung_front_kg=80.0, unsprung_rear_kg=80.0,
        gross_limit_kg=2000.0, front_axle_limit_kg=1000.0, rear_axle_limit_kg=1050.0,
        loading_area_m=(1.4, 2.8),
    ),
    payload_seen_kg=(0.0, 600.0),
    front_share_seen_pct=(42.0, 55.0),
)  # fmt: skip


def cab_gateway(directory: Path) -> Gateway:
    """A driving service that has published nothing yet."""
    gateway = Gateway(directory, calibrated=VAN)
    gateway.status = BEFORE
    return gateway


def loaded(n: int, payload_kg: float, front_share_pct: float) -> Estimate:
    """The n-th batch with this aboard."""
    return make_estimate(n).answered(posterior_of(payload_kg, front_share_pct, 6.0, 0.2))


def aboard(payload_kg: float, front_share_pct: float, std_kg: float = 6.0) -> Weights:
    """Its weights with this aboard."""
    posterior = Posterior(np.array([payload_kg, front_share_pct]), np.diag([std_kg**2, 0.04]))
    return weights_of(VAN.vehicle, posterior)


def vaguely_loaded(n: int, payload_kg: float, of_useful: float = 1.1) -> Estimate:
    """A load whose 95 % interval is so many times as wide as one that is just of use."""
    assert VAN.vehicle is not None
    std_kg = of_useful * VAN.vehicle.useful_half_width_kg / Z95
    return make_estimate(n).answered(posterior_of(payload_kg, 50.0, std_kg, 0.2))


def load_event(gateway: Gateway, t_s: int, change_kg: float, *, is_withdrawn: bool = False) -> None:
    """Stored as the service stores one; 500 kg are aboard after it."""
    record = {
        "id": f"event-{t_s}", "revision": 1, "vehicle_id": "van-17", "t_start": iso_utc((t_s - 60) * S),
        "t_end": iso_utc(t_s * S), "change_kg": change_kg, "change_std_kg": 7.0,
        "change_interval95_kg": [change_kg - 14.0, change_kg + 14.0], "probability": 0.999,
        "is_withdrawn": is_withdrawn, "place": None, "stops": [], "before": {}, "after": {"payload_kg": 500.0},
    }  # fmt: skip
    gateway.store.write_entry(EntryKind.EVENT, record["id"], t_s * S, json_line(record))
