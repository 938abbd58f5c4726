"""The uplink of a service."""

from importlib.metadata import version

from gateway.setup import Setup
from gateway.store import Store
from gateway.uplink import Outbox, Uplink, UplinkSettings


def uplink_of(wanted: UplinkSettings | None, setup: Setup, store: Store) -> Uplink | None:
    """None where no broker is configured."""
    if wanted is None:
        return None
    birth = {
        "vehicle_id": setup.identity.vehicle_id,
        "vin": setup.identity.vin,
        "version": version("springscale"),
        "estimator": setup.estimator,
        "calibration_id": setup.calibration.id if setup.calibration else None,
    }
    # the place in the queue belongs to where letters go: another broker or branch begins from the first row
    return Uplink(wanted, Outbox(store.reader(), store, f"mqtt://{wanted.broker}/{wanted.topic}"), birth)
