"""python -m benchmarks.accuracy: studies of calibration and estimation by experiment. Each takes minutes.

    python -m benchmarks.accuracy coverage --vans 12 --seed 20265 --workers 2 --output docs

prints its page; ``--output`` also writes the numbers (NAME.json) and the page (NAME.md).
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from benchmarks.accuracy import advice as on_advice
from benchmarks.accuracy import alarm_days as on_alarm_days
from benchmarks.accuracy import alarms as on_alarms
from benchmarks.accuracy import availability as on_availability
from benchmarks.accuracy import budget as on_budget
from benchmarks.accuracy import coverage as on_coverage
from benchmarks.accuracy import delivery as on_delivery
from benchmarks.accuracy import disturbances as on_disturbances
from benchmarks.accuracy import false_facts as on_false_facts
from benchmarks.accuracy import faults as on_faults
from benchmarks.accuracy import grades as on_grades
from benchmarks.accuracy import phones as on_phones
from benchmarks.accuracy import sensitivity as on_sensitivity
from benchmarks.accuracy import siblings as on_siblings
from benchmarks.accuracy.bounds import limits, limits_table
from benchmarks.accuracy.budget import budget_page
from benchmarks.accuracy.coverage_drives import Scope
from benchmarks.accuracy.coverage_page import coverage_page
from benchmarks.accuracy.delivery_page import delivery_page
from benchmarks.accuracy.disturbances_page import disturbances_page
from benchmarks.accuracy.faults_page import faults_page
from benchmarks.accuracy.grades_page import grades_page
from benchmarks.accuracy.pages import advice_page, learning_curve_page
from benchmarks.accuracy.sensitivity import sensitivity_page
from benchmarks.accuracy.siblings import siblings_page
from gateway.calibration.campaign import load_campaign
from gateway.calibration.inspection import SplitRun
from gateway.calibration.judgement import learning_curve as on_learning
from gateway.cli.options import FILE, batch_settings, window
from gateway.cli.progress import counted
from gateway.config import ESTIMATOR_NAMES
from gateway.core.cross_spectrum.ideal_drive import Drive
from gateway.core.vehicle import Vehicle
from gateway.errors import SpringscaleError
from gateway.offline import inspect

Study = Callable[..., None]


def _seed(seed: int) -> Callable[[Study], Study]:
    return click.option("--seed", type=click.IntRange(min=0), default=seed, show_default=True)


_workers = click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="processes")
_kept = click.option("--kept", type=FILE, default=None, help="directory of cases to resume from: read and stored there")
_output = click.option("--output", type=FILE, default=None, help="directory to write the numbers and their page to")


def _vans(seed: int, n_vans: int = Scope().n_vans, least: int = 2) -> Callable[[Study], Study]:
    """Options of a study that drives fresh vans."""
    vans = click.option("--vans", "n_vans", type=click.IntRange(min=least), default=n_vans, show_default=True)
    return lambda study: vans(_seed(seed)(_workers(study)))


@click.group()
def studies() -> None:
    """Experiments on calibration: fewer runs, advised runs, coverage of intervals, the limit. Each takes minutes."""


@studies.command("learning-curve")
@click.argument("campaign", type=FILE)
@click.option("--estimator", "estimators", type=click.Choice(ESTIMATOR_NAMES), multiple=True, default=ESTIMATOR_NAMES)
@click.option(
    "--subsets",
    "most_subsets",
    type=click.IntRange(min=1),
    default=on_learning.MOST_SUBSETS,
    show_default=True,
    help="choices of runs to try for each number of runs",
)
@_seed(on_learning.SEED)
@_output
@window
def learning_curve(
    campaign: Path,
    estimators: tuple[str, ...],
    most_subsets: int,
    seed: int,
    output: Path | None,
    window_s: float | None,
) -> None:
    """How accurate would CAMPAIGN be with 2, 3, 4, 6, 10 of its runs? Leaves runs out."""
    runs, vehicle = _read(campaign, window_s)
    with counted("calibrating and judging") as on_trial:
        found = on_learning.curve_of(
            runs,
            vehicle,
            name=vehicle.name,
            estimators=estimators,
            most_subsets=most_subsets,
            seed=seed,
            on_trial=on_trial,
        ).to_json()
    _hand_out("learning_curve", found, learning_curve_page(found), output)


@studies.command("advice")
@click.argument("campaign", type=FILE)
@_output
@window
def advice(campaign: Path, output: Path | None, window_s: float | None) -> None:
    """Does driving the loads that --plan advises help? Uses CAMPAIGN's own runs as the next ones."""
    runs, vehicle = _read(campaign, window_s)
    with counted("calibrating and judging") as on_fit:
        found = on_advice.advice_of(runs, vehicle, name=vehicle.name, on_fit=on_fit).to_json()
    _hand_out("advice", found, advice_page(found), output)


@studies.command("coverage")
@_vans(on_coverage.SEED)
@_output
def coverage(n_vans: int, seed: int, workers: int, output: Path | None) -> None:
    """Do 95 % intervals contain the truth? Simulated vans, each calibrated and then driven elsewhere; ~40 s a van."""
    with counted("calibrating and driving vans") as on_van:
        found = on_coverage.coverage(Scope(n_vans=n_vans), seed, workers=workers, on_van=on_van).to_json()
    _hand_out("coverage", found, coverage_page(found), output)


@studies.command("budget")
@_vans(on_budget.SEED)
@_output
def budget(n_vans: int, seed: int, workers: int, output: Path | None) -> None:
    """Does the error agree with its budget? Each source alone, then all at once; ~3 min a van."""
    with counted("driving vans with each source alone") as on_van:
        alone = on_budget.alone(n_vans, seed, workers=workers, on_van=on_van)
    with counted("driving vans with all sources at once") as on_van:
        together = on_budget.together(n_vans, seed + 1, workers=workers, on_van=on_van)
    found = {"seed": seed, "n_vans": n_vans, "alone": alone, "together": together}
    _hand_out("budget", found, budget_page(found), output)


@studies.command("disturbances")
@_vans(on_disturbances.SEED)
@_output
def disturbances(n_vans: int, seed: int, workers: int, output: Path | None) -> None:
    """The effect of jitter, losses, lags and moved sensors on calibrated vans; ~2 min a van."""
    with counted("calibrating, driving and disturbing vans") as on_van:
        found = on_disturbances.disturbances(Scope(n_vans=n_vans), seed, workers=workers, on_van=on_van).to_json()
    _hand_out("disturbances", found, disturbances_page(found), output)


@studies.command("sensor-grades")
@_vans(on_grades.SEED, on_grades.N_VANS)
@_output
def sensor_grades(n_vans: int, seed: int, workers: int, output: Path | None) -> None:
    """The accuracy with sensors of other noise, resolution and rate, on the same drives of the same vans; ~6 minutes a
    van.
    """
    with counted("calibrating and driving vans with every sensor") as on_van:
        found = on_grades.grades(Scope(n_vans=n_vans), seed, workers=workers, on_van=on_van)
    _hand_out("sensor-grades", found, grades_page(found), output)


@studies.command("faults")
@click.argument("campaign", type=FILE)
@click.option("--calibration", type=FILE, required=True, help="calibration file of that vehicle")
@click.option("--runs", type=click.IntRange(min=1), multiple=True, help="numbers of the drives [default: all]")
@_seed(on_faults.SEED)
@_workers
@_kept
@_output
def faults(
    campaign: Path,
    calibration: Path,
    runs: tuple[int, ...],
    seed: int,
    workers: int,
    kept: Path | None,
    output: Path | None,
) -> None:
    """The effect of faulty sensors on CAMPAIGN's drives: each log rewritten with each fault; ~2 minutes a drive."""
    study = on_faults.Study(campaign, calibration, runs or None, kept=kept, seed=seed)
    with counted("weighing drives with faulty sensors") as on_case:
        found = on_faults.faults(study, workers=workers, on_case=on_case)
    _hand_out("sensor-faults", found, faults_page(found), output)


@studies.command("delivery")
@click.option("--seeds", "n_days", type=click.IntRange(min=1), default=on_delivery.N_DAYS, show_default=True)
@_seed(on_delivery.SEED)
@_workers
@_kept
@_output
def delivery(n_days: int, seed: int, workers: int, kept: Path | None, output: Path | None) -> None:
    """Are load events found, and are any reported without a change? Simulated delivery days of vans; ~25 s a day."""
    with counted("driving delivery days") as on_day:
        found = on_delivery.delivery(n_days, seed, workers=workers, kept=kept, on_day=on_day)
    _hand_out("events", found, delivery_page(found), output)


@studies.command("alarms")
@click.option("--loads", "n_loads", type=click.IntRange(min=1), default=on_alarms.N_LOADS, show_default=True)
@_seed(on_alarms.SEED)
@click.option("--days", "n_days", type=click.IntRange(min=1), default=on_delivery.N_DAYS, show_default=True)
@_workers
@_kept
@_output
def alarms(n_loads: int, seed: int, n_days: int, workers: int, kept: Path | None, output: Path | None) -> None:
    """Are alarms right, and are they steady? Made-up loads, then delivery days; ~25 s a day."""
    with counted("weighing loads about a limit") as on_line:
        found = on_alarms.alarms(n_loads, seed, on_line)
    with counted("driving delivery days") as on_day:
        found["days"] = on_alarm_days.days(n_days, on_delivery.SEED, workers=workers, kept=kept, on_day=on_day)
    _hand_out("alarm_rules", found, on_alarms.alarms_page(found), output)


@studies.command("sensitivity")
@_vans(on_sensitivity.SEED)
@_output
def sensitivity(n_vans: int, seed: int, workers: int, output: Path | None) -> None:
    """The effect of each chosen constant: halved and doubled in turn; ~4 minutes a van."""
    with counted("driving vans, calibrating and weighing them over and over") as on_van:
        found = on_sensitivity.sensitivity(Scope(n_vans=n_vans), seed, workers=workers, on_van=on_van).to_json()
    _hand_out("sensitivity", found, sensitivity_page(found), output)


@studies.command("siblings")
@_vans(on_siblings.SEED)
@_output
def siblings(n_vans: int, seed: int, workers: int, output: Path | None) -> None:
    """How much does a line help its next van? Simulated siblings calibrated in six ways; ~1 min a van."""
    with counted("calibrating lines and driving their siblings") as on_line:
        found = on_siblings.siblings(n_vans, seed, workers=workers, on_van=on_line).to_json()
    _hand_out("siblings", found, siblings_page(found), output)


@studies.command("false-facts")
@click.option("--lines", "n_lines", type=click.IntRange(min=1), default=on_false_facts.N_LINES, show_default=True)
@click.option("--right", "n_right", type=click.IntRange(min=1), default=on_false_facts.N_RIGHT, show_default=True)
@_seed(on_false_facts.SEED)
@_workers
@_output
def false_facts(n_lines: int, n_right: int, seed: int, workers: int, output: Path | None) -> None:
    """Which false facts does commissioning catch, and does it accept true ones? ~3 minutes a line."""
    with counted("commissioning simulated vans") as on_line:
        tried = on_false_facts.false_facts(n_lines, n_right, seed, workers=workers, on_van=on_line)
    for line in on_false_facts.each_line(tried):
        click.echo(line, err=True)
    found = tried.to_json()
    _hand_out("false-facts", found, on_false_facts.false_facts_page(found), output)


@studies.command("phones")
@click.option("--rounds", "n_rounds", type=click.IntRange(min=1), default=2, show_default=True, help="times each van")
@_seed(on_phones.SEED)
@_output
def phones(n_rounds: int, seed: int, output: Path | None) -> None:
    """The accuracy of a phone beside a CAN IMU on the same drives; ~2 minutes a round."""
    with counted("driving vans with a phone on the floor") as on_drive:
        found = on_phones.phones(n_rounds, seed, on_drive)
    _hand_out("phone_accuracy", found, on_phones.phones_page(found), output)


@studies.command("availability")
@_vans(on_availability.SEED, 2, least=1)
def availability(n_vans: int, seed: int, workers: int) -> None:
    """How much of the time on the road do estimates cover in slow or broken driving? ~1 minute a van."""
    with counted("driving vans through slow and broken worlds") as on_van:
        lines = on_availability.table_of(n_vans, seed, workers=workers, on_van=on_van)
    click.echo("\n".join(lines))


@studies.command("bounds")
@click.option("--duration-s", type=click.FloatRange(min=20.0), default=300.0, show_default=True, help="driving seen")
@click.option("--speed-kmh", type=click.FloatRange(10.0, 200.0), default=50.0, show_default=True, help="steady speed")
def bounds(duration_s: float, speed_kmh: float) -> None:
    """Cramer-Rao bounds of payload and front share for the paper's van on its road, by observation and prior
    knowledge.
    """
    click.echo(limits_table(limits(Drive(duration_s, speed_kmh / 3.6))), nl=False)


def _read(path: Path, window_s: float | None) -> tuple[Sequence[SplitRun], Vehicle]:
    """The runs of a campaign, without those with a fault."""
    campaign = load_campaign(path)
    with counted("reading drives") as on_run:
        return inspect(campaign, batch_settings(window_s), on_run=on_run).usable, campaign.vehicle


def _hand_out(name: str, found: Mapping[str, Any], page: str, output: Path | None) -> None:
    """Print the page; with ``output`` also write it and the numbers as files."""
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        (output / f"{name}.json").write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        (output / f"{name}.md").write_text(page, encoding="utf-8")
    click.echo(page, nl=False)


if __name__ == "__main__":
    try:
        studies(prog_name="python -m benchmarks.accuracy")
    except SpringscaleError as fault:
        click.echo(str(fault), err=True)
        sys.exit(fault.exit_code)
