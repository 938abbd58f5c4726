"""Made-up loads about a limit: whole batches with what they and their load say, as the flow would give them."""

from dataclasses import replace

from gateway.core.vehicle import Vehicle
from gateway.core.weights import weighed
from gateway.estimate import Epoch, Estimate, Quantity
from support.days import batch

VAN = Vehicle(
    "van",
    empty_mass_kg=1600.0,
    wheelbase_m=3.0,
    track_width_m=1.5,
    unsprung_front_kg=100.0,
    unsprung_rear_kg=100.0,
    gross_limit_kg=2500.0,
    rear_axle_limit_kg=1500.0,
)
LIMIT_KG = 700.0  # of payload: what makes the gross weight the permitted one


def of_load(
    n: int,
    kg: float,
    load_kg: float | None = None,
    *,
    share_pct: float = 50.0,
    n_batches: int = 1,
    std_kg: float = 14.0,
) -> Estimate:
    """The n-th batch of five minutes, and what ``n_batches`` of its load found together."""
    found = batch(5.0 * n, 5.0 * (n + 1), kg, share_pct)
    together = Quantity.normal(kg if load_kg is None else load_kg, std_kg if n_batches == 1 else 0.8 * std_kg)
    found = replace(
        found,
        payload=Quantity.normal(kg, std_kg),
        correlation=0.0,
        epoch=Epoch(together, Quantity.normal(share_pct, 0.5), n_batches),
    )
    return weighed(found, VAN)
