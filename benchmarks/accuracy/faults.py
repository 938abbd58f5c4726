"""The effect of ordinary sensor faults on estimates of recorded drives: refused, covered, or wrong.

    faults(Drives(Path("campaign.toml"), Path("vehicle.json"))) -> numbers for section

Every log is rewritten with every fault (faulty_logs) and weighed as `springscale estimate` does.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.faulty_logs import Fault, Log, faults_of
from benchmarks.accuracy.markdown import Column, Row, all_but, refused_cell, table_of, text
from benchmarks.accuracy.study import OnDone, cases_of
from gateway.bus.logs import write_candump
from gateway.bus.logs.open import open_log
from gateway.calibration.campaign_file import Campaign, RunTable, chosen_runs, load_campaign
from gateway.estimates.batch_estimate import Estimate
from gateway.offline.estimates import estimates_of_logs
from gateway.records import Frames, Why
from gateway.setup import Setup, load_setup

SEED: Final = 20_271  # arbitrary, of this study alone


@dataclass(frozen=True, slots=True)
class Drives:
    """The drives by their numbers (None: all), their calibration, and the seed of the faults."""

    campaign: Path
    calibration: Path
    runs: tuple[int, ...] | None = None
    names: tuple[str, ...] | None = None  # of faults; None: every one whose signals are mapped
    seed: int = SEED


@dataclass(frozen=True, slots=True)
class Judged:
    """A whole batch of a rewritten drive: the reasons of its refusal, or the truth's distance outside the 95 %
    intervals.

    In half-widths beyond the interval's end; 0 if it is inside.
    """

    rejected: tuple[str, ...]
    payload_outside: float
    front_share_outside: float

    @property
    def is_held(self) -> bool:
        """Answered, with the truth in both intervals."""
        return not self.rejected and self.payload_outside == self.front_share_outside == 0.0


@dataclass(frozen=True, slots=True)
class Case:
    """One drive with one fault, and its processor time."""

    cpu_s: float
    batches: tuple[Judged, ...]


def faults(
    drives: Drives, *, workers: int = 1, kept: Path | None = None, on_case: OnDone = lambda done, of: None
) -> dict[str, Any]:
    """Weigh every drive with every fault; a line for every fault and strength, over all drives."""
    _, setup, runs, known = _loaded(drives)
    cases = cases_of(
        partial(_case, drives),
        len(runs) * len(known),
        workers=workers,
        kept=kept,
        stored=partial(_name_of, drives),
        on_done=on_case,
    )
    return {
        "campaign": f"{drives.campaign.parent.name}/{drives.campaign.name}",
        "calibration": setup.calibration.id if setup.calibration else None,
        "seed": drives.seed,
        "n_drives": len(runs),
        "cpu_s": round(sum(case.cpu_s for case in cases)),
        "lines": [
            _line(fault, [one for case in cases[i :: len(known)] for one in case.batches])
            for i, fault in enumerate(known)
        ],
    }


def _line(fault: Fault, batches: Sequence[Judged]) -> dict[str, Any]:
    answered = [one for one in batches if not one.rejected]
    return {
        "fault": fault.name,
        "strength": fault.strength,
        "n_batches": len(batches),
        "n_refused": len(batches) - len(answered),
        "refused_by_reason": dict(sorted(Counter(why for one in batches for why in one.rejected).items())),
        "n_held": sum(one.is_held for one in answered),
        "payload_furthest": round(max((one.payload_outside for one in answered), default=0.0), 2),
        "front_share_furthest": round(max((one.front_share_outside for one in answered), default=0.0), 2),
    }


@lru_cache(maxsize=1)
def _loaded(drives: Drives) -> tuple[Campaign, Setup, list[tuple[int, RunTable]], list[Fault]]:
    campaign = load_campaign(drives.campaign)
    setup = load_setup(campaign.signals, drives.calibration)
    known = [one for one in faults_of(setup.signal_map) if drives.names is None or one.name in drives.names]
    return campaign, setup, chosen_runs(campaign, drives.runs), known


@lru_cache(maxsize=1)
def _log_of(drives: Drives, run: RunTable) -> Log:
    campaign, setup, *_ = _loaded(drives)
    chunks = list(open_log(campaign.log_of(run), setup.signal_map)[0])
    columns = ("t_ns", "can_id", "length", "payload")
    frames = Frames(*(np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in columns))
    return Log(frames, setup.signal_map)


def _case(drives: Drives, number: int) -> Case:
    """One drive with one fault; the faults of one drive are consecutive."""
    run_number, run, fault = _of_number(drives, number)
    return _weighed(drives, run, fault, np.random.default_rng([drives.seed, run_number, *fault.id.encode()]))


def _name_of(drives: Drives, number: int) -> str:
    """The name under which the case is stored."""
    run_number, _, fault = _of_number(drives, number)
    return f"{drives.seed}-{run_number}-{fault.id}"


def _of_number(drives: Drives, number: int) -> tuple[int, RunTable, Fault]:
    _, _, runs, known = _loaded(drives)
    return *runs[number // len(known)], known[number % len(known)]


def _weighed(drives: Drives, run: RunTable, fault: Fault, rng: np.random.Generator) -> Case:
    campaign, setup, *_ = _loaded(drives)
    begun_s = time.process_time()
    log = _log_of(drives, run)
    with TemporaryDirectory() as folder:
        rewritten = Path(folder) / "can.log"
        write_candump(fault.rewrite(log, rng).frames, setup.signal_map.channel or "can0", rewritten)
        found = [one for one in estimates_of_logs([rewritten], setup) if Why.TOO_SHORT not in one.rejected]
    payload_kg = math.nan if run.payload_kg is None else run.payload_kg
    batches = tuple(_judged(one, payload_kg, campaign.front_share_pct(run)) for one in found)
    return Case(time.process_time() - begun_s, batches)


def _judged(found: Estimate, payload_kg: float, front_share_pct: float) -> Judged:
    if found.rejected:
        return Judged(tuple(str(why) for why in found.rejected), 0.0, 0.0)
    return Judged(
        (), _outside(found.payload.interval95, payload_kg), _outside(found.front_share.interval95, front_share_pct)
    )


def _outside(interval: tuple[float, float], true: float) -> float:
    low, high = interval
    return max(low - true, true - high, 0.0) / (0.5 * (high - low))


LEAST_SAFE: Final = 0.9  # chosen: of the batches


def section(found: Mapping[str, Any]) -> str:
    """The sums, and a row for every fault with several answers outside an interval, or one that lies far outside."""
    lines = found["lines"]
    total = {name: sum(line[name] for line in lines) for name in ("n_batches", "n_refused", "n_held")}
    wrong = [line for line in lines if _n_outside(line)]
    unsafe = [
        f"{line['fault']} {line['strength']}".strip()
        for line in lines
        if _n_outside(line) > (1.0 - LEAST_SAFE) * line["n_batches"]
    ]
    sums = [
        f"- Refused: {total['n_refused']} of {total['n_batches']} batches.",
        f"- Answered, and held by both intervals: {total['n_held']}.",
        f"- Answered outside an interval: {total['n_batches'] - total['n_refused'] - total['n_held']}, under "
        f"{len(wrong)} of {len(lines)} faults and strengths.",
        f"- Refused or held in at least {100.0 * LEAST_SAFE:.0f} % of the batches: {all_but(unsafe)}",
    ]
    shown = [line for line in wrong if line is lines[0] or _n_outside(line) > 1 or _is_far(line)]
    return "\n".join([*sums, "", *table_of(COLUMNS, shown), ""])


def _n_outside(line: Mapping[str, Any]) -> int:
    return int(line["n_batches"] - line["n_refused"] - line["n_held"])


def _is_far(line: Mapping[str, Any]) -> bool:
    """Whether the truth lies a half-width or more beyond the end of an interval."""
    return max(line[f"{quantity}_furthest"] or 0.0 for quantity in ("payload", "front_share")) >= 1.0


def _furthest(quantity: str) -> Callable[[Row], str]:
    return lambda line: f"{line[f'{quantity}_furthest']:.2f}" if line[f"{quantity}_furthest"] else ""


COLUMNS: Final[tuple[Column, ...]] = (
    ("Fault", text("fault")),
    ("Strength", text("strength")),
    ("Refused, and why", lambda line: refused_cell(line["n_refused"], line["refused_by_reason"])),
    ("Outside", lambda line: str(_n_outside(line))),
    ("Payload outside by up to", _furthest("payload")),
    ("Share outside by up to", _furthest("front_share")),
)
