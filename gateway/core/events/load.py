"""What was weighed, batch by batch, and batches of one load together."""

from collections.abc import Sequence
from dataclasses import dataclass

from gateway.core.fusion import (
    CG_LEFT_OWN_STD_M,
    FRONT_SHARE_OWN_STD_PCT,
    PAYLOAD_OWN_STD_KG,
    Found,
    Fused,
    begun_of,
    found_of,
    is_told,
    teaches,
)
from gateway.estimate import Estimate


@dataclass(frozen=True, slots=True)
class Weighing:
    """One batch that counted: raw numbers, for a tare that comes or goes is no change of load.

    ``at`` is its place among all batches, ``by`` the calibration and the estimator.
    """

    at: int
    by: tuple[str | None, str]
    payload_kg: Found
    front_share_pct: Found
    cg_left_m: Found | None


@dataclass(frozen=True, slots=True)
class Load:
    """Weighings first to last (inclusive, by their number), taken as of one load."""

    first: int
    last: int
    payload_kg: Fused
    front_share_pct: Fused
    cg_left_m: Fused | None

    @property
    def n_batches(self) -> int:
        return self.last - self.first + 1


def weighings_of(estimates: Sequence[Estimate]) -> list[Weighing]:
    """Those of the batches that tell a load."""
    return [_weighing(at, one) for at, one in enumerate(estimates) if teaches(one)]


def load_of(weighings: Sequence[Weighing], first: int, last: int) -> Load:
    """Weighings first to last together."""
    parts = weighings[first : last + 1]
    cg_left = [part.cg_left_m for part in parts if part.cg_left_m is not None]
    return Load(
        first,
        last,
        _together([part.payload_kg for part in parts]),
        _together([part.front_share_pct for part in parts]),
        _together(cg_left) if cg_left else None,
    )


def _weighing(at: int, estimate: Estimate) -> Weighing:
    tare = estimate.tare
    payload, share = (tare.raw_payload, tare.raw_front_share) if tare else (estimate.payload, estimate.front_share)
    return Weighing(
        at,
        (estimate.calibration_id, estimate.estimator),
        found_of(estimate, payload, PAYLOAD_OWN_STD_KG),
        found_of(estimate, share, FRONT_SHARE_OWN_STD_PCT),
        found_of(estimate, estimate.cg_left, CG_LEFT_OWN_STD_M) if is_told(estimate.cg_left) else None,
    )


def _together(found: Sequence[Found]) -> Fused:
    mean = begun_of(found[0])
    for one in found[1:]:
        mean = mean.joined(one)
    return mean
