"""Made-up delivery days: estimates without frames, as the flow would give them."""

from dataclasses import replace

import numpy as np

from gateway.core.change import Rules
from gateway.core.events.entry import Entry
from gateway.core.events.ledger import Ledger
from gateway.estimates.batch_estimate import UNWATCHED, Estimate, Place, Stop, Watched, Way, Weight, Weights
from gateway.estimates.posterior import Posterior, Source
from gateway.records import Why
from gateway.units import NS_PER_S

T0_NS = 1_790_000_000_000_000_000
RULES = Rules(range_kg=1000.0, mass_kg=2000.0)
OWN_KG, SHARED_KG = 8.0, 12.0
OWN_PCT, SHARED_PCT = 0.25, 0.43


def at(minutes: float) -> int:
    return T0_NS + round(minutes * 60 * NS_PER_S)


def posterior(kg: float, share_pct: float = 50.0, own_kg: float = OWN_KG) -> Posterior:
    """A posterior with an error of the day that is the same in every batch."""
    of_day = np.diag([SHARED_KG, SHARED_PCT])
    return Posterior(np.array([kg, share_pct]), np.diag([own_kg**2, OWN_PCT**2]), {Source.DAY: of_day})


def batch(
    begin_min: float,
    end_min: float,
    kg: float | None,
    share_pct: float = 50.0,
    *,
    stops: tuple[Stop, ...] = (),
    before: Watched = UNWATCHED,
    metres: float = 3000.0,
    place: Place = Place(),  # noqa: B008 - frozen
) -> Estimate:
    """A whole batch; kg None: rejected."""
    way = Way(metres, 60.0 * (end_min - begin_min), 50.0 * (end_min - begin_min), stops=stops, before=before, end=place)
    bare = Estimate(at(begin_min), at(end_min), "cross_spectrum", "sha256:1", vehicle_id="van", way=way)
    if kg is None:
        return replace(bare, rejected=(Why.TOO_SHORT,))
    gross = Weight(2000.0 + kg, 20.0, 2500.0, None)
    return replace(bare, weights=Weights(gross=gross)).answered(posterior(kg, share_pct))


def day(*kg_of_leg: float | None, batches: int = 1, door: bool | None = None) -> list[Estimate]:
    """Legs of 5 minutes a batch, a quarter of an hour apart from one end to the next beginning."""
    found, minute = [], 0.0
    for i, kg in enumerate(kg_of_leg):
        for k in range(batches):
            before = Watched(door, None) if i and not k else UNWATCHED
            found.append(batch(minute, minute + 5.0, kg, before=before))
            minute += 5.0
        minute += 15.0
    return found


def told(estimates: list[Estimate], rules: Rules = RULES) -> dict[str, Entry]:
    """The last revision of every entry, ordered by id."""
    ledger = Ledger(rules)
    return {entry.id: entry for one in estimates for entry in ledger.add(one)}


def events(estimates: list[Estimate]) -> list[dict]:
    return [entry.record for entry in told(estimates).values() if entry.kind == "event"]


def trips(estimates: list[Estimate]) -> list[dict]:
    return [entry.record for entry in told(estimates).values() if entry.kind == "trip"]
