"""What a vehicle learns from drives and statements, tried on recorded drives.

    python -m benchmarks.accuracy.taught DATA [--splits 3] [--output docs]

DATA holds campaigns with a roll rate (campaign_roll.toml). Known loads teach a vehicle, which weighs the other sets;
with its calibration two vehicles of its model are taught by their empty drives alone. Then, in random splits, four
mixed drives teach a vehicle and it weighs the others. One steady empty drive teaches with the four, of which nothing
is said or whose kilograms a delivery note states; or known loads teach with them. Known loads, and the empty drive,
also teach alone. Prints payload and front share, each with mean error, bias, share held by the 95 % interval, half-
width and interval score, in percent of the payload range and of 20 points; ``--output`` writes them to taught.json.
"""

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.calibration.campaign_file import load_campaign
from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.statements import NOTHING_KNOWN, Statement, empty
from gateway.calibration.teach import teach
from gateway.core.batch_settings import BatchSettings
from gateway.core.cargo import shape_hypotheses
from gateway.core.vehicle import Vehicle
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.quantity import Z95
from gateway.model.vehicle_model import VehicleModel
from gateway.model.weigh import by_cross_spectrum
from gateway.offline.campaigns import split_runs
from gateway.records import F64
from gateway.stated.statement import StatementSource

KNOWN_AND_TESTS: Final = {
    "known_loads": ("mixed", "speeds", "sideways", "shapes"),
    "second_van/known_loads": ("second_van/mixed",),
    "solid_axles/known_loads": ("solid_axles/mixed",),
}
SISTER: Final = "known_loads"
SIBLINGS: Final = ("siblings/van_1", "siblings/van_2")
NOTE_PLUS_MINUS: Final = 25.0 / 450.0  # of the payload range, half a 95 % interval
SHARE_SPAN_PCT: Final = 20.0
SEED: Final = 7


def runs_of(folder: Path) -> tuple[Vehicle, list[StatedDrive], list[StatedDrive]]:
    """The vehicle, the first parts of a campaign's drives, and the last."""
    campaign = load_campaign(folder / "campaign_roll.toml")
    split = split_runs(campaign, BatchSettings())
    return campaign.vehicle, [one.identification for one in split], [one.validation for one in split]


def whole(first: Sequence[StatedDrive], last: Sequence[StatedDrive]) -> list[StatedDrive]:
    """Whole drives."""
    return [replace(one, batches=(*one.batches, *other.batches)) for one, other in zip(first, last, strict=True)]


def note(run: StatedDrive, span_kg: float, rng: np.random.Generator) -> Statement:
    """A delivery note: kilograms with an error, and no place."""
    plus_minus_kg = NOTE_PLUS_MINUS * span_kg
    said_kg = max(0.0, run.payload_kg + float(rng.normal(0.0, plus_minus_kg / Z95)))
    return Statement(source=StatementSource.DELIVERY_NOTE, payload_kg=said_kg, payload_plus_minus_kg=plus_minus_kg)


def taught(
    runs: Sequence[StatedDrive], said: Sequence[Statement], vehicle: Vehicle, sister: VehicleModel | None = None
) -> VehicleModel:
    """The vehicle that these drives teach."""
    drives = [StatedDrive(run.log, run.batches, one) for run, one in zip(runs, said, strict=True)]
    return teach(drives, vehicle, sister).model


def weighed(runs: Sequence[StatedDrive], model: VehicleModel, vehicle: Vehicle) -> tuple[list[F64], Counter[str]]:
    """Rows of truth, answer and interval (8,) of every batch that is answered, and the reasons of the others."""
    shapes = shape_hypotheses(vehicle, *model.known_shape)
    rows: list[F64] = []
    refused: Counter[str] = Counter()
    for run in runs:
        for batch in run.batches:
            if batch.rejected:
                continue
            told = by_cross_spectrum(batch, model, shapes, Estimate(batch.t_start_ns, batch.t_end_ns, "cross_spectrum"))
            if told.rejected:
                refused[str(told.rejected[0])] += 1
                continue
            by_share = vehicle.empty_front_share_std_pct * vehicle.empty_mass_kg
            share = told.front_share.widened(by_share / (vehicle.empty_mass_kg + told.payload.number))
            payload = (run.payload_kg, told.payload.number, *told.payload.interval95)
            rows.append(np.array([*payload, run.front_share_pct, share.number, *share.interval95]))
    return rows, refused


Line = dict[str, Any]
"""A set of drives: title, n, refused, and under payload and share the figures of FIGURES, each in percent."""

FIGURES: Final = ("error", "bias", "held", "half", "score")


def line_of(title: str, rows: Sequence[F64], refused: Counter[str], span_kg: float) -> Line:
    """The figures of the batches of one set."""
    line: Line = {"title": title, "n": len(rows), "refused": sum(refused.values())}
    for name, columns, span in (("payload", slice(0, 4), span_kg), ("share", slice(4, 8), SHARE_SPAN_PCT)):
        true, answer, low, high = np.array(rows).reshape(-1, 8)[:, columns].T
        missed = np.maximum(0.0, np.maximum(low - true, true - high))
        held = span * ((low <= true) & (true <= high))
        each = (abs(answer - true), answer - true, held, 0.5 * (high - low), high - low + 40.0 * missed)
        of_set = [round(100.0 * float(np.mean(one)) / span, 2) if rows else None for one in each]
        line[name] = dict(zip(FIGURES, of_set, strict=True))
    print(said(line), flush=True)
    return line


def said(line: Line) -> str:
    """The figures as text."""
    if not line["n"]:
        return f"{line['title']:34} no batch is answered, {line['refused']} refused"
    shown = (" ".join(f"{name} {line[of][name]:6.2f}" for name in FIGURES) for of in ("payload", "share"))
    return f"{line['title']:34} n {line['n']:3d} refused {line['refused']} | {' | '.join(shown)}"


def on_known_loads(data: Path) -> Iterator[Line]:
    """Calibrate on known loads and weigh their last thirds and the other sets."""
    for name, tests in KNOWN_AND_TESTS.items():
        vehicle, first, last = runs_of(data / name)
        span_kg = vehicle.payload_range_kg[1] - vehicle.payload_range_kg[0]
        model = taught(first, [run.statement for run in first], vehicle)
        yield line_of(f"{name}, last thirds", *weighed(last, model, vehicle), span_kg)
        for test in tests:
            _, *both = runs_of(data / test)
            yield line_of(test, *weighed(whole(*both), model, vehicle), span_kg)
        if name == SISTER:
            yield from on_siblings(data, model)


def on_siblings(data: Path, sister: VehicleModel) -> Iterator[Line]:
    """Vehicles of one model, taught by their empty drives and a sister."""
    for name in SIBLINGS:
        vehicle, *both = runs_of(data / name / "empty")
        span_kg = vehicle.payload_range_kg[1] - vehicle.payload_range_kg[0]
        drives = whole(*both)
        model = taught(drives, [empty()] * len(drives), vehicle, sister)
        _, *tests = runs_of(data / name / "test")
        yield line_of(f"{name}, empty and a sister", *weighed(whole(*tests), model, vehicle), span_kg)


def on_ordinary_drives(data: Path, n_splits: int) -> Iterator[Line]:
    """One steady empty drive and four mixed ones teach; the other mixed drives test, beside ten known loads."""
    for name, (mixed, *_) in KNOWN_AND_TESTS.items():
        vehicle, *both = runs_of(data / name)
        steady, (_, *parts) = whole(*both), runs_of(data / mixed)
        drives = whole(*parts)
        span_kg = vehicle.payload_range_kg[1] - vehicle.payload_range_kg[0]
        rng = np.random.default_rng(SEED)
        known = [run.statement for run in steady]
        always = {
            "ten known loads": taught(steady, known, vehicle),
            "one empty drive": taught(steady[:1], [empty()], vehicle),
        }
        rows: dict[str, list[F64]] = {}
        refused: dict[str, Counter[str]] = {}
        for _ in range(n_splits):
            order = rng.permutation(len(drives)).tolist()
            teaching = [drives[i] for i in order[:4]]
            tests = [drives[i] for i in order[4:]] or teaching[3:]
            nothing = [NOTHING_KNOWN] * len(teaching)
            notes = [note(run, span_kg, rng) for run in teaching]
            models = always | {
                "ten known loads and four drives": taught([*steady, *teaching], [*known, *nothing], vehicle),
                "nothing said": taught([steady[0], *teaching], [empty(), *nothing], vehicle),
                "delivery notes": taught([steady[0], *teaching], [empty(), *notes], vehicle),
            }
            for kind, model in models.items():
                found, why = weighed(tests, model, vehicle)
                rows.setdefault(kind, []).extend(found)
                refused.setdefault(kind, Counter()).update(why)
        for kind, found in rows.items():
            yield line_of(f"{mixed}: {kind}", found, refused[kind], span_kg)


def main() -> None:
    """Print every line, and write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder of recorded campaigns")
    parser.add_argument("--splits", type=int, default=3, help="random splits of the mixed drives")
    parser.add_argument("--output", type=Path, default=None, help="folder for taught.json")
    asked = parser.parse_args()
    lines = [*on_known_loads(asked.data), *on_ordinary_drives(asked.data, asked.splits)]
    if asked.output is not None:
        told = json.dumps({"splits": asked.splits, "lines": lines}, indent=1)
        (asked.output / "taught.json").write_text(f"{told}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
