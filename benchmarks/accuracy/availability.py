"""The share of the time on the road that estimates cover, in driving that is slow, short or broken by stops.

Every van is calibrated by known loads at 50 km/h and then driven through each world with one load, or with one that
changes at a stop. A second on the road counts as covered if it is within an estimate that is not provisional.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.delivery_days import ROAD
from benchmarks.accuracy.drives import MAP_NAME, FreshVan, Scope, fresh_van, unseen_load
from benchmarks.accuracy.markdown import Column, number, page, table_of, text
from benchmarks.accuracy.study import Study
from gateway.bus.signals import SHIPPED_PREFIX, Decoder, load_signal_map
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.flow import Flow, Identity
from gateway.core.settings import BatchSettings
from gateway.estimate import Estimate
from gateway.records import F64, I64, Bool, Motion, Signal, joined
from gateway.sim.drive import Drive, Leg, drive_of, standstill
from gateway.sim.scenario import simulate_drive
from gateway.sim.vehicle import Load, payload_kg
from gateway.units import NS_PER_S
from gateway.workbench.wiring import Wiring

SEED: Final = 20_300  # arbitrary, of this study alone
ESTIMATOR: Final = "cross_spectrum"
STANDSTILL_MPS: Final = 0.5  # BatchSettings.standstill_speed_mps
START_NS: Final = 1_790_000_000_000_000_000  # arbitrary, in 2026
HOUR_S: Final = 3600.0  # seconds
HOP_S: Final = (100.0, 280.0)  # chosen: shorter than a window

Hop = tuple[Drive, float]  # the drive, and the seconds of standstill after it


@dataclass(frozen=True, slots=True)
class World:
    """``hops`` draws the drives; ``is_changed``: another load from the middle stop on."""

    name: str
    hops: Callable[[np.random.Generator], list[Hop]]
    is_changed: bool = False


def _slow(
    rng: np.random.Generator, kmh: tuple[float, float], hold_s: tuple[float, float], stop_share: float, for_s: float
) -> Drive:
    """From rest to rest, with stops of 3 to 40 s between legs."""
    legs, left_s = [Leg(0.0, 3.0)], for_s
    while left_s > 0.0:
        leg = Leg(rng.uniform(*kmh) / 3.6, rng.uniform(*hold_s), rng.uniform(0.7, 1.8))
        pause = [Leg(0.0, rng.uniform(3.0, 40.0), 1.5)] if rng.random() < stop_share else []
        left_s -= sum(one.hold_s + 6.0 for one in (leg, *pause))
        legs += [leg, *pause]
    return drive_of([*legs, Leg(0.0, 3.0, 1.5)])


def _delivery(rng: np.random.Generator) -> list[Hop]:
    """Twenty short hops in town with a minute or two at each door; none is long enough for a batch."""
    return [
        (_slow(rng, (20.0, 45.0), (8.0, 40.0), 0.4, float(rng.uniform(*HOP_S))), float(rng.uniform(75.0, 150.0)))
        for _ in range(20)
    ]


def _changing(rng: np.random.Generator) -> list[Hop]:
    """Seven minutes, a stop of 20 s, and eight more."""
    return [(_slow(rng, (35.0, 55.0), (30.0, 90.0), 0.0, t_s), 20.0) for t_s in (400.0, 480.0)]


WORLDS: Final = (
    World("town, 15 to 30 km/h", lambda rng: [(_slow(rng, (15.0, 30.0), (8.0, 50.0), 0.6, HOUR_S), 0.0)]),
    World("stop and go, below 30 km/h", lambda rng: [(_slow(rng, (8.0, 30.0), (5.0, 25.0), 1.0, HOUR_S), 0.0)]),
    World("delivery: hops of 2 to 5 minutes", _delivery),
    World("load changes during a stop of 20 s", _changing, is_changed=True),
)


@dataclass(frozen=True, slots=True)
class Found:
    """One drive: seconds on the road, seconds within estimates, and each estimate's (error, half-width, is covered) in
    kg.
    """

    moving_s: float
    covered_s: float
    errors_kg: tuple[tuple[float, float, bool], ...]
    n_refused: int


def driven(fresh: FreshVan, calibrated: CalibratedVehicle, world: World, seed: np.random.SeedSequence) -> Found:
    """One van through one world."""
    rng = np.random.default_rng(seed)
    hops = world.hops(rng)
    first = unseen_load(fresh.van, rng)
    other = unseen_load(fresh.van, rng) if world.is_changed else first
    signal_map = load_signal_map(SHIPPED_PREFIX + MAP_NAME)
    parts, carried, start_ns = list[Motion](), list[tuple[int, tuple[Load, ...]]](), START_NS
    for i, (drive, stand_s) in enumerate(hops):
        loads = first if i < len(hops) / 2 else other
        whole = drive.then(standstill(stand_s)) if stand_s else drive
        recorded = simulate_drive(fresh.van, loads, ROAD, whole, fresh.sensors, int(rng.integers(2**31)), start_ns)
        parts.append(Decoder(signal_map).decode(Wiring(MAP_NAME).frames_of(recorded.recording)))
        carried.append((start_ns, loads))
        start_ns += round(whole.duration_s * NS_PER_S)
    motion = joined(parts)
    flow = Flow(BatchSettings(), signal_map.traits, calibrated, ESTIMATOR, Identity())
    found = [one for one in (*flow.feed(motion), *flow.flush()) if not one.is_remainder]
    return _judged(motion, carried, found)


def _judged(motion: Motion, carried: list[tuple[int, tuple[Load, ...]]], found: list[Estimate]) -> Found:
    t_ns, speed_mps = motion.of(Signal.SPEED)
    step_s = np.minimum(np.diff(t_ns, append=t_ns[-1]) / NS_PER_S, 1.0)
    moving_s = np.where(speed_mps >= STANDSTILL_MPS, step_s, 0.0)
    answered = [one for one in found if one.counted]
    return Found(
        moving_s=float(moving_s.sum()),
        covered_s=float(moving_s[_within(t_ns, answered)].sum()),
        errors_kg=tuple(_error_of(one, _true_kg(one, t_ns, moving_s, carried)) for one in answered),
        n_refused=len(found) - len(answered),
    )


def _within(t_ns: I64, estimates: list[Estimate]) -> Bool:
    inside = np.zeros(len(t_ns), bool)
    for one in estimates:
        inside |= (t_ns >= one.t_start_ns) & (t_ns < one.t_end_ns)
    return inside


def _true_kg(one: Estimate, t_ns: I64, moving_s: F64, carried: list[tuple[int, tuple[Load, ...]]]) -> float:
    """The load on board for most of the time on the road."""
    inside = (t_ns >= one.t_start_ns) & (t_ns < one.t_end_ns)
    bounds = [start_ns for start_ns, _ in carried[1:]]
    of_hop = np.searchsorted(bounds, t_ns[inside], side="right")
    weights: dict[float, float] = {}
    for hop, seconds in zip(of_hop, moving_s[inside], strict=True):
        kg = payload_kg(carried[hop][1])
        weights[kg] = weights.get(kg, 0.0) + float(seconds)
    return max(weights, key=lambda kg: weights[kg])


def _error_of(one: Estimate, true_kg: float) -> tuple[float, float, bool]:
    low, high = one.payload.interval95
    return one.payload.number - true_kg, 0.5 * (high - low), low <= true_kg <= high


def of_one_van(seed: int, number: int) -> list[Found]:
    """One van through every world."""
    fresh = fresh_van(Scope(), seed, number)
    calibrated = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR)
    seeds = fresh.test_seed.spawn(len(WORLDS))
    return [driven(fresh, calibrated, world, one) for world, one in zip(WORLDS, seeds, strict=True)]


def numbers(seed: int, n: int, vans: Sequence[list[Found]]) -> dict[str, Any]:
    """A row for each world."""
    rows = [{"world": world.name, **_row(each)} for world, each in zip(WORLDS, zip(*vans, strict=True), strict=True)]
    return {"seed": seed, "n_vans": n, "rows": rows}


def _row(found: Sequence[Found]) -> dict[str, Any]:
    errors = [error for one in found for error in one.errors_kg]
    moving_s, covered_s = (sum(getattr(one, which) for one in found) for which in ("moving_s", "covered_s"))
    return {
        "moving_min": moving_s / 60.0,
        "covered_pct": 100.0 * covered_s / moving_s,
        "n": len(errors),
        "n_refused": sum(one.n_refused for one in found),
        "mean_abs_kg": float(np.mean([abs(error[0]) for error in errors])) if errors else None,
        "half_width_kg": float(np.mean([error[1] for error in errors])) if errors else None,
        "n_held": sum(error[2] for error in errors),
    }


COLUMNS: Final[tuple[Column, ...]] = (
    ("world", text("world")),
    ("on the road [min]", number("moving_min", 0)),
    ("covered", lambda row: f"{row['covered_pct']:.0f} %"),
    ("estimates", text("n")),
    ("refused", text("n_refused")),
    ("mean error [kg]", number("mean_abs_kg", 1, unknown="-")),
    ("half-width [kg]", number("half_width_kg", 0, unknown="-")),
    ("held", lambda row: f"{row['n_held']} of {row['n']}"),
)


def availability_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    return page(
        "Time covered by estimates",
        f"availability --vans {found['n_vans']} --seed {found['seed']}",
        *table_of(COLUMNS, found["rows"]),
        "",
    )


STUDY: Final = Study(
    name="availability",
    does="How much of the time on the road do estimates cover in slow or broken driving? ~1 minute a van.",
    doing="driving vans through slow and broken worlds",
    of_case=of_one_van,
    numbers=numbers,
    page=availability_page,
    seed=SEED,
    n=2,
    least=1,
)
