"""The effect of ordinary sensor faults on estimates of recorded drives: refused, covered, or wrong.

    faults(Study(Path("campaign.toml"), Path("vehicle.json"))) -> numbers for faults_page

Every log is rewritten with every fault (faulty_logs) and weighed as `springscale estimate` does.
"""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.faulty_logs import Fault, Log, faults_of
from benchmarks.accuracy.runner import OnDone, kept, run_each
from gateway.bus.logs import write_candump
from gateway.bus.logs.open import open_log
from gateway.calibration.campaign import Campaign, RunTable, chosen_runs, load_campaign
from gateway.estimate import Estimate
from gateway.offline import estimates_of_logs
from gateway.records import Frames, Why
from gateway.setup import Setup, load_setup

SEED: Final = 20_271  # arbitrary, of this study alone


@dataclass(frozen=True, slots=True)
class Study:
    """The drives by their numbers (None: all), their calibration, and the directory of stored cases."""

    campaign: Path
    calibration: Path
    runs: tuple[int, ...] | None = None
    names: tuple[str, ...] | None = None  # of faults; None: every one whose signals are mapped
    kept: Path | None = None
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


def faults(study: Study, *, workers: int = 1, on_case: OnDone = lambda done, of: None) -> dict[str, Any]:
    """Weigh every drive with every fault; a line for every fault and strength, over all drives."""
    _, setup, runs, known = _loaded(study)
    cases = list(run_each(partial(_case, study), len(runs) * len(known), workers, on_case))
    return {
        "campaign": f"{study.campaign.parent.name}/{study.campaign.name}",
        "calibration": setup.calibration.id if setup.calibration else None,
        "seed": study.seed,
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
def _loaded(study: Study) -> tuple[Campaign, Setup, list[tuple[int, RunTable]], list[Fault]]:
    campaign = load_campaign(study.campaign)
    setup = load_setup(campaign.signals, study.calibration)
    known = [one for one in faults_of(setup.signal_map) if study.names is None or one.name in study.names]
    return campaign, setup, chosen_runs(campaign, study.runs), known


@lru_cache(maxsize=1)
def _log_of(study: Study, run: RunTable) -> Log:
    campaign, setup, *_ = _loaded(study)
    chunks = list(open_log(campaign.log_of(run), setup.signal_map)[0])
    columns = ("t_ns", "can_id", "length", "payload")
    frames = Frames(*(np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in columns))
    return Log(frames, setup.signal_map)


def _case(study: Study, number: int) -> Case:
    """The case, from ``study.kept`` if it was stored there. The faults of one drive are consecutive."""
    _, _, runs, known = _loaded(study)
    (run_number, run), fault = runs[number // len(known)], known[number % len(known)]

    def weighed() -> dict[str, Any]:
        return asdict(_weighed(study, run, fault, np.random.default_rng([study.seed, run_number, *fault.id.encode()])))

    stored = kept(study.kept, f"{study.seed}-{run_number}-{fault.id}", weighed)
    return Case(stored["cpu_s"], tuple(Judged(tuple(one.pop("rejected")), **one) for one in stored["batches"]))


def _weighed(study: Study, run: RunTable, fault: Fault, rng: np.random.Generator) -> Case:
    campaign, setup, *_ = _loaded(study)
    begun_s = time.process_time()
    log = _log_of(study, run)
    with TemporaryDirectory() as folder:
        rewritten = Path(folder) / "can.log"
        write_candump(fault.rewrite(log, rng).frames, setup.signal_map.channel or "can0", rewritten)
        found = [one for one in estimates_of_logs([rewritten], setup) if Why.TOO_SHORT not in one.rejected]
    batches = tuple(_judged(one, run.payload_kg, campaign.front_share_pct(run)) for one in found)
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
