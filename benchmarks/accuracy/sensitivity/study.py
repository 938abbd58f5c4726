"""Every constant halved and doubled: calibrate, weigh and inspect the same fresh vans, and compare."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.coverage_table import JudgedBatch, coverage_table, judged_batches
from benchmarks.accuracy.drives import TRIPS, USUAL, FreshVan, Scope, driven, fresh_van, unseen_load
from benchmarks.accuracy.markdown import Column, Row, number, page, table_of, text
from benchmarks.accuracy.sensitivity.changes import Pair, pairs_of
from benchmarks.accuracy.sensitivity.constants import CONSTANTS, FACTORS, Acts, Constant, scaled
from benchmarks.accuracy.study import Study
from gateway.calibration.half_car.known_spectra import known_spectra
from gateway.calibration.inspection.axes import apart_findings, phase_findings, phases
from gateway.calibration.inspection.finding import Kind
from gateway.calibration.inspection.loads import compare_loads
from gateway.calibration.judgement.evaluation import judge
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.change import Rules
from gateway.core.cross_spectrum.measured import CrossSpectra

ESTIMATOR: Final = "cross_spectrum"
SEED: Final = 20_283  # arbitrary, of this study alone
MISLABELLED_SHARE: Final = 1.0 / 3.0  # chosen: of the rated payload, the error of a laden run's label
AS_IT_IS: Final = "as it is"


Inspected = dict[str, int]  # right drives and labels and how many were doubted, wrong ones and how many were named


@dataclass(frozen=True, slots=True)
class OfVan:
    """One van under every setting, by its name."""

    batches: list[JudgedBatch]
    pairs: dict[str, list[Pair]]
    inspected: dict[str, Inspected]


def of_one_van(seed: int, number: int, constants: Sequence[Constant] = CONSTANTS, scope: Scope = USUAL) -> OfVan:
    """One van under every setting."""
    fresh = fresh_van(scope, seed, number)
    tests = [
        driven(fresh.van, unseen_load(fresh.van, fresh.rng), trip, scope, one, len(fresh.runs) + i, fresh.sensors)
        for i, (trip, one) in enumerate(zip(TRIPS.values(), fresh.test_seed.spawn(len(TRIPS)), strict=True), 1)
    ]
    found = OfVan([], {}, {})
    usual = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR)
    for name, constant, factor in _settings(constants):
        with scaled(constant, factor) if constant else nullcontext():
            acts = constant.acts if constant else None
            if acts in (None, Acts.IN_INSPECTION):
                found.inspected[name] = _inspected(fresh)
            if acts is not Acts.IN_INSPECTION:
                is_refitted = acts is Acts.IN_CALIBRATION
                calibrated = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR) if is_refitted else usual
                _weigh(name, calibrated, tests, found)
    return found


def _settings(constants: Sequence[Constant]) -> Iterator[tuple[str, Constant | None, float]]:
    yield AS_IT_IS, None, 1.0
    for constant in constants:
        for factor in FACTORS:
            yield setting(constant, factor), constant, factor


def setting(constant: Constant, factor: float) -> str:
    """The name of a constant's lines."""
    return f"{constant.name} x {factor:g}"


def _weigh(name: str, calibrated: CalibratedVehicle, tests: Sequence[KnownRun], found: OfVan) -> None:
    drives = [judge([run], calibrated, ESTIMATOR) for run in tests]
    found.pairs[name] = pairs_of(drives, Rules.of(calibrated.vehicle))
    for run, judged in zip(tests, drives, strict=True):
        found.batches.extend(judged_batches(judged, calibrated.vehicle, name, ESTIMATOR, run))


def _weighing(line: dict[str, Any], pairs: Sequence[Pair]) -> dict[str, Any]:
    """One setting over all vans. ``smallest_change_kg`` is the median over pairs of batches, ``n_false`` of the
    ``n_unchanged`` pairs showed a change, ``n_seen`` of the ``n_changed`` pairs with a larger true change did.
    """
    unchanged = [pair for pair in pairs if pair.is_one_load]
    changed = [pair for pair in pairs if abs(pair.change_kg) > pair.smallest_kg]
    return {
        "line": line,
        "smallest_change_kg": float(np.median([pair.smallest_kg for pair in pairs])) if pairs else None,
        "n_unchanged": len(unchanged),
        "n_false": sum(pair.is_noticed for pair in unchanged),
        "n_changed": len(changed),
        "n_seen": sum(pair.is_noticed for pair in changed),
    }


def _inspected(fresh: FreshVan) -> Inspected:
    """Right labels and a wrong one; right axes and a pitch rate with the wrong sign."""
    doubted = {number for number, _ in compare_loads(fresh.runs, fresh.vehicle)}
    laden = max(fresh.runs, key=lambda run: run.payload_kg)
    wrong_kg = laden.payload_kg - MISLABELLED_SHARE * fresh.vehicle.payload_range_kg[1]
    mislabelled = [replace(run, payload_kg=wrong_kg) if run is laden else run for run in fresh.runs]
    named = {number for number, _ in compare_loads(mislabelled, fresh.vehicle)}
    known_runs = known_spectra(fresh.runs, fresh.vehicle)
    upright = [_kinds_of_axes(known.spectra, known.run, fresh) for known in known_runs]
    turned = [_kinds_of_axes(known.spectra.with_pitch_reversed(), known.run, fresh) for known in known_runs]
    return {
        "n_right": len(fresh.runs) + len(known_runs),
        "n_doubted": len(doubted) + sum(map(bool, upright)),
        "n_wrong": 1 + len(known_runs),
        "n_named": (laden.number in named) + sum(Kind.PITCH_RATE_SIGN in kinds for kinds in turned),
    }


def _kinds_of_axes(spectra: CrossSpectra, run: KnownRun, fresh: FreshVan) -> set[StrEnum]:
    seen = phases(spectra, run, fresh.vehicle)
    return {finding.kind for finding in (*apart_findings(spectra, seen), *phase_findings(seen, None))}


def numbers(seed: int, n: int, vans: Sequence[OfVan], constants: Sequence[Constant] = CONSTANTS) -> dict[str, Any]:
    """By setting ("NAME x 0.5", or as it is): the results of weighing and of inspection; and the original values."""
    table = coverage_table([batch for van in vans for batch in van.batches], seed)
    lines = {line["kind"]: line for line in table["lines"]}
    pairs = {name: [pair for van in vans for pair in van.pairs[name]] for name in vans[0].pairs}
    inspected = {
        name: {key: sum(van.inspected[name][key] for van in vans) for key in of_van}
        for name, of_van in vans[0].inspected.items()
    }
    return {
        "seed": seed,
        "n_vans": n,
        "constants": {one.name: [float(x) for x in np.ravel(one.current)] for one in constants},
        "weighing": {name: _weighing(lines[name], of_setting) for name, of_setting in pairs.items()},
        "inspection": inspected,
    }


def sensitivity_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    usual = found["weighing"][AS_IT_IS]
    return page(
        "Sensitivity",
        f"sensitivity --output DIR --vans {found['n_vans']} --seed {found['seed']}",
        "Some constants follow from no derivation. Here each is halved and doubled in turn, all else as it is, on "
        f"{found['n_vans']} simulated vans that were not used to choose any setting: calibrated on six known "
        f"loads, then driven "
        "once in each of the ways of [coverage](coverage.md), each time with another load. Errors are percent of "
        "the rated payload and of 20 percentage points, over batches that were answered; held is the share of "
        "these whose 95 % interval holds the truth, +- the mean of half these intervals, and the score that of "
        "their width and 40 times what the truth lies outside.",
        "",
        *table_of(WEIGHED, _settings_of(found["weighing"])),
        "",
        "## Smallest detectable change of load",
        "",
        f"Between two batches of five minutes, a change of {usual['smallest_change_kg']:.0f} kg (median) is "
        "noticed every other time if the front share stays; a change of the share helps. Of the pairs of batches "
        f"with one load {usual['n_false']} of {usual['n_unchanged']} were taken for two; of those with loads "
        f"further apart than that {usual['n_seen']} of {usual['n_changed']} were.",
        "",
        "## Inspection",
        "",
        "The known drives of the same vans: as they are, with a third of the rated payload missing on the label of "
        "the heaviest, and with the pitch rate turned over.",
        "",
        *table_of(INSPECTED, _settings_of(found["inspection"])),
        "",
        "## What each decides",
        "",
        *(_decided(one, found["constants"][one.name]) for one in CONSTANTS if one.name in found["constants"]),
        "",
    )


def _settings_of(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The rows of a table: as it is, then each constant in each setting that was tried."""
    tried = [(f"`{one.name}`", f"{by:g}", setting(one, by)) for one in CONSTANTS for by in FACTORS]
    rows = [("as they are", "1", AS_IT_IS), *tried]
    return [{"constant": name, "times": by, **found[key]} for name, by, key in rows if key in found]


def _of_line(cell: Callable[[Row], str]) -> Callable[[Row], str]:
    return lambda row: cell(row["line"])


def _held(quantity: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        coverage = row["line"][f"{quantity}_coverage"]
        return "–" if coverage is None else f"{100.0 * coverage['share']:.0f} %"

    return cell


WEIGHED: Final[tuple[Column, ...]] = (
    ("Constant", text("constant")),
    ("times", text("times")),
    ("Payload, mean abs. error %", _of_line(number("payload_mean_abs_pct", unknown="–"))),
    ("Share, mean abs. error %", _of_line(number("front_share_mean_abs_pct", unknown="–"))),
    ("Payload held", _held("payload")),
    ("Share held", _held("front_share")),
    ("Payload, +- %", _of_line(number("payload_half_width_pct", unknown="–"))),
    ("score %", _of_line(number("payload_interval_score_pct", unknown="–"))),
    ("Share, +- %", _of_line(number("front_share_half_width_pct", unknown="–"))),
    ("score %", _of_line(number("front_share_interval_score_pct", unknown="–"))),
    ("Refused", _of_line(lambda line: f"{line['n_rejected']} of {line['n_batches']}")),
    ("Change of load that shows, kg", number("smallest_change_kg", 0, unknown="–")),
    ("Changes seen where none was", lambda row: f"{row['n_false']} of {row['n_unchanged']}"),
)
INSPECTED: Final[tuple[Column, ...]] = (
    ("Constant", text("constant")),
    ("times", text("times")),
    ("Right ones doubted", lambda row: f"{row['n_doubted']} of {row['n_right']}"),
    ("Wrong ones named", lambda row: f"{row['n_named']} of {row['n_wrong']}"),
)


def _decided(constant: Constant, was: Sequence[float]) -> str:
    numbers = ", ".join(f"{x:g}" for x in was)
    return f"- `{constant.name}` ({numbers}), in {constant.acts}: {constant.decides}."


STUDY: Final = Study(
    name="sensitivity",
    does="The effect of each chosen constant: halved and doubled in turn; ~4 minutes a van.",
    doing="driving vans, calibrating and weighing them over and over",
    of_case=of_one_van,
    numbers=numbers,
    page=sensitivity_page,
    seed=SEED,
    n=12,
)
