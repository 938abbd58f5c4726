"""Batches with known loads, as a store would have them."""

from dataclasses import replace
from pathlib import Path

from gateway.core.change import Rules
from gateway.core.fusion import epoch_of, fused_epoch
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_to_json
from gateway.store import Store
from gateway.units import NS_PER_S
from support.estimates import posterior_of
from support.patience import PATIENCE_S

START_NS = 1_790_000_000_000_000_000
WINDOW_NS = 300 * NS_PER_S


def drive_of(
    n: int,
    payload_kg: float,
    *,
    start_ns: int = START_NS,
    share_pct: float = 50.0,
    calibration_id: str | None = None,
    estimator: str = "ratio_index",
) -> list[Estimate]:
    """``n`` batches of one load, fused as the flow does: one drive."""
    found, epoch = [], None
    for i in range(n):
        batch = Estimate(
            t_start_ns=start_ns + i * WINDOW_NS,
            t_end_ns=start_ns + (i + 1) * WINDOW_NS,
            estimator=estimator,
            calibration_id=calibration_id,
        ).answered(posterior_of(payload_kg, share_pct, 5.0, 0.3))
        epoch = fused_epoch(epoch, batch, Rules())
        found.append(replace(batch, epoch=epoch_of(epoch.posterior, epoch.n_batches)))
    return found


def stored(directory: Path, *drives: list[Estimate]) -> Store:
    """A store that has them; the test closes it."""
    store = Store.open(directory)
    for drive in drives:
        for batch in drive:
            store.write_estimate(estimate_to_json(batch))
    assert store.flush(PATIENCE_S)
    return store
