"""The required quality of a sensor: the same fresh vans on the same drives, with sensors of other noise, resolution and
rate.

Each van is calibrated and driven with each sensor, because a noisy sensor is used for calibration too. A drive as
calibrated and a mixed one carry loads within the calibrated range, near the centre line, as for the disturbances.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from benchmarks.accuracy.calibrated import calibrated_on
from benchmarks.accuracy.coverage_table import ALL_KINDS, JudgedBatch, judged_batches, pooled
from benchmarks.accuracy.disturbances import ESTIMATOR, WITHIN_PARTS, WITHIN_PLACES
from benchmarks.accuracy.disturbed import noisier
from benchmarks.accuracy.drives import AS_CALIBRATED, TRIPS, USUAL, Scope, driven, fresh_van
from benchmarks.accuracy.markdown import number, page, rejected_cell, table
from benchmarks.accuracy.study import Study
from gateway.calibration.judgement.evaluation import judge
from gateway.errors import CalibrationImpossibleError
from gateway.sim.sensors import CANMOD, REFERENCE, Sensors
from gateway.sim.vehicle import Load
from gateway.units import STANDARD_GRAVITY_MPS2

SEED: Final = 20_285  # arbitrary, of this study alone
N_VANS: Final = 3  # chosen: one of each type
Found = tuple[list[JudgedBatch], list[str]]
TIMES: Final = (2.0, 5.0, 10.0, 20.0)  # chosen: factors of the reference unit's noise


def _as_coarse_as_canmod(sensors: Sensors) -> Sensors:
    imu = sensors.imu
    accel = replace(imu.accel, resolution=CANMOD.imu.accel.resolution)
    return replace(
        sensors, imu=replace(imu, accel=accel, gyro=replace(imu.gyro, resolution=CANMOD.imu.gyro.resolution))
    )


def _sampled(rate_hz: float) -> Callable[[Sensors], Sensors]:
    """The unit's low-pass scales with the rate."""
    corner_hz = REFERENCE.imu.corner_hz * rate_hz / REFERENCE.imu.rate_hz
    return lambda sensors: replace(sensors, imu=replace(sensors.imu, rate_hz=rate_hz, corner_hz=corner_hz))


AS_SIMULATED: Final = "reference unit"
GRADES: Final[Mapping[str, Callable[[Sensors], Sensors]]] = MappingProxyType(
    {
        AS_SIMULATED: lambda mounted: mounted,
        **{f"accelerometer's noise x {by:g}": noisier(accel=by) for by in TIMES},
        **{f"gyro's noise x {by:g}": noisier(gyro=by) for by in TIMES},
        **{f"both x {by:g}": noisier(by, by) for by in TIMES},
        "resolutions of CANmod.gps": _as_coarse_as_canmod,
        "50 samples a second": _sampled(50.0),
        "one fix a second": lambda sensors: replace(sensors, gps=replace(sensors.gps, rate_hz=1.0)),
    }
)
"""Sensors by name, each by its difference from the reference unit."""


def numbers(seed: int, n: int, vans: Sequence[Found]) -> dict[str, Any]:
    """The table, and each sensor's noise and resolution. ``refused`` lists impossible calibrations."""
    sensors = [{"name": name, **_facts(sensors_of(REFERENCE))} for name, sensors_of in GRADES.items()]
    return {"grades": sensors, **pooled(seed, n, vans)}


def _facts(sensors: Sensors) -> dict[str, float]:
    imu = sensors.imu
    return {
        "accel_noise_mps2_per_rthz": imu.accel.noise_density,
        "gyro_noise_radps_per_rthz": imu.gyro.noise_density,
        "accel_resolution_mps2": imu.accel.resolution,
        "gyro_resolution_radps": imu.gyro.resolution,
        "rate_hz": imu.rate_hz,
        "fixes_hz": sensors.gps.rate_hz,
    }


def of_one_van(seed: int, number: int, scope: Scope = USUAL) -> Found:
    """One van calibrated, driven and judged with every sensor."""
    batches: list[JudgedBatch] = []
    refused: list[str] = []
    for name, sensors_of in GRADES.items():
        fresh = fresh_van(scope, seed, number, sensors_of)
        van = fresh.van
        try:
            calibrated = calibrated_on(fresh.runs, fresh.vehicle, ESTIMATOR)
        except CalibrationImpossibleError as fault:
            refused.append(f"{van.name}: {name}: {fault}")
            continue
        for trip, seeds in zip((AS_CALIBRATED, TRIPS["mixed"]), fresh.test_seed.spawn(2), strict=True):
            place_m = float(fresh.rng.uniform(*WITHIN_PLACES)) * van.wheelbase_m
            load = Load(float(fresh.rng.uniform(*WITHIN_PARTS)) * van.rated_payload_kg, place_m)
            run = driven(van, (load,), trip, scope, seeds, len(batches), fresh.sensors)
            judged = judge([run], calibrated, ESTIMATOR)
            batches += judged_batches(judged, fresh.vehicle, name, ESTIMATOR, run)
    return batches, refused


AS_GOOD_WITHIN: Final = 1.25  # times the reference unit's; chosen as the studies' limit for "as good"
WORKS_WITHIN: Final = 2.0  # times its half-widths; chosen: a scale with half the precision is still useful
HELD: Final = 0.9  # chosen: of the intervals, at least
AS_GOOD, WORKS, FAILS = "as good", "works", "does not"
QUANTITIES: Final = ("payload", "front_share")
SETS: Final = {  # by the start of a set's name: the page names the noisiest sensor of these that works
    "accelerometer": ("accelerometer's noise", "accel_noise_mps2_per_rthz"),
    "gyro": ("gyro's noise", "gyro_noise_radps_per_rthz"),
}
OTHERS: Final = ("resolutions of CANmod.gps", "50 samples a second", "one fix a second")
COLUMNS: Final = (
    "Sensor", "Accelerometer, m/s2/√Hz", "Gyro, rad/s/√Hz", "Batches", "Refused, and why",
    "Payload, mean abs. error %", "+- %", "95 % covers", "Share, mean abs. error %", "+- %", "95 % covers", "Verdict",
)  # fmt: skip


def grades_page(found: Mapping[str, Any]) -> str:
    """The whole page in Markdown."""
    n_vans = len(found["vans"])
    return page(
        "How good a sensor must be",
        f"sensor-grades --vans {n_vans} --seed {found['seed']} --output DIR",
        f"{n_vans} simulated vans that were not used to choose any setting, each with every sensor on the same "
        "drives: calibrated with it on six known loads of ten minutes near 50 km/h, then driven twice with a load "
        "within the calibrated ones, as calibrated and mixed (town, country, motorway). The reference unit gives "
        f"{_of(found)['rate_hz']:g} samples and {_of(found)['fixes_hz']:g} fixes a second, rounded to "
        f"{_of(found)['accel_resolution_mps2']:g} m/s2 and {_of(found)['gyro_resolution_radps']:.1e} rad/s; every "
        "other line changes one thing of it. Noise is white, its density one-sided, that of each axis. Errors "
        "are percent of the rated payload and of 20 percentage points, over the weighed batches; +- is the mean "
        "half-width of the 95 % intervals. A sensor is as good if both errors and both half-widths stay within "
        f"{AS_GOOD_WITHIN:g} times those of the reference unit and no more than one batch in ten more is refused; "
        f"it works if both half-widths stay within {WORKS_WITHIN:g} times and no more than one batch in five more "
        f"is refused; for both, {100 * HELD:.0f} % of the intervals contain the truth. Half-widths do not rise "
        "evenly: with so few vans, the calibration of a single van affects the mean.",
        "",
        *table(COLUMNS, (_cells(found, one) for one in found["grades"])),
        "",
        *[f"- No calibration: {text}" for text in found["refused"]],
        *([""] if found["refused"] else []),
        limits(found),
        note="Everything is simulated.",
    )


def limits(found: Mapping[str, Any]) -> str:
    """The noisiest accelerometer and gyro that are as good as the reference unit, and that work, in data sheets'
    units.
    """
    noisiest = "".join(
        f"- {words}: accelerometer up to {_accel(_noisiest(found, verdicts, 'accelerometer'))}, gyro up to "
        f"{_gyro(_noisiest(found, verdicts, 'gyro'))}, each with the other as in the reference unit.\n"
        for words, verdicts in (
            ("As good as the simulated reference unit", (AS_GOOD,)),
            (f"Works, with intervals up to {WORKS_WITHIN:g} times as wide", (AS_GOOD, WORKS)),
        )
    )
    others = [f"{name} ({verdict_of(found, name)})" for name in OTHERS]
    return f"{noisiest}- Else tried: {', '.join(others)}.\n"


def verdict_of(found: Mapping[str, Any], name: str) -> str:
    """Whether this sensor is as good as the reference unit, works, or does not, by the page's criteria."""
    line, reference = _line(found, name), _line(found, AS_SIMULATED)
    if line is None or reference is None or line["n_vans"] < reference["n_vans"]:
        return FAILS
    errors, widths = (
        [_ratio(line, reference, f"{quantity}_{what}_pct") for quantity in QUANTITIES]
        for what in ("mean_abs", "half_width")
    )
    more = line["n_rejected"] / line["n_batches"] - reference["n_rejected"] / reference["n_batches"]
    coverages = [line[f"{quantity}_coverage"] for quantity in QUANTITIES]
    if any(coverage is None or coverage["share"] < HELD for coverage in coverages):
        return FAILS
    if more <= 0.1 and max(*errors, *widths) <= AS_GOOD_WITHIN:
        return AS_GOOD
    return WORKS if more <= 0.2 and max(widths) <= WORKS_WITHIN else FAILS


def _ratio(line: Mapping[str, Any], reference: Mapping[str, Any], key: str) -> float:
    return math.inf if line[key] is None else float(line[key] / reference[key])


def _accel(density: float) -> str:
    return f"{density:.2g} m/s2/√Hz ({1e6 * density / STANDARD_GRAVITY_MPS2:.0f} µg/√Hz)"


def _gyro(density: float) -> str:
    return f"{density:.2g} rad/s/√Hz ({math.degrees(density):.2g} °/s/√Hz)"


def _noisiest(found: Mapping[str, Any], verdicts: tuple[str, ...], sensor: str) -> float:
    """The noisiest before the first with another verdict."""
    beginning, key = SETS[sensor]
    best: float = _of(found)[key]
    for one in found["grades"]:
        if one["name"].startswith(beginning):
            if verdict_of(found, one["name"]) not in verdicts:
                break
            best = one[key]
    return best


def _of(found: Mapping[str, Any]) -> Mapping[str, Any]:
    """The facts of the reference unit."""
    reference: Mapping[str, Any] = next(one for one in found["grades"] if one["name"] == AS_SIMULATED)
    return reference


def _line(found: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    return next((line for line in found["lines"] if line["kind"] == name != ALL_KINDS), None)


def _cells(found: Mapping[str, Any], grade: Mapping[str, Any]) -> list[str]:
    noise = [f"{grade['accel_noise_mps2_per_rthz']:.2g}", f"{grade['gyro_noise_radps_per_rthz']:.2g}"]
    line = _line(found, grade["name"])
    if line is None:
        return [grade["name"], *noise, *["none"] * (len(COLUMNS) - 4), FAILS]
    cells = [grade["name"], *noise, str(line["n_batches"]), rejected_cell(line)]
    for quantity in QUANTITIES:
        coverage = line[f"{quantity}_coverage"]
        cells += [number(f"{quantity}_{what}_pct")(line) for what in ("mean_abs", "half_width")]
        cells.append("none" if coverage is None else f"{100 * coverage['share']:.0f} %")
    return [*cells, verdict_of(found, grade["name"])]


STUDY: Final = Study(
    name="sensor-grades",
    does="The accuracy with sensors of other noise, resolution and rate, on the same drives of the same vans; "
    "~6 minutes a van.",
    doing="calibrating and driving vans with every sensor",
    of_case=of_one_van,
    numbers=numbers,
    page=grades_page,
    seed=SEED,
    n=N_VANS,
)
