"""Estimates of logs, as `springscale estimate` prints them, and of arrays, for measurements without a CAN log."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.logs import LogReport, motion_of_log
from gateway.calibration.file import CalibrationFile
from gateway.core.batch_settings import BatchSettings
from gateway.errors import ArraysError
from gateway.estimates.batch_estimate import Estimate
from gateway.records import F64, Motion, Signal
from gateway.setup import Setup
from gateway.units import NS_PER_S
from gateway.weighing.flow import Flow, Identity

AS_THE_SERVICE: Final = BatchSettings()


def estimates_of_logs(
    logs: Sequence[Path | str],
    setup: Setup,
    settings: BatchSettings = AS_THE_SERVICE,
    *,
    on_read: Callable[[LogReport], None] = lambda report: None,
    with_remainders: bool = False,
) -> Iterator[Estimate]:
    """Every batch of every log in turn; each log is a drive. Raises LogUnreadableError.

    ``on_read`` gets the reader's report of each log. Stretches too short for a batch (``is_remainder``) are left out
    unless they are asked for.
    """
    for log in logs:
        flow = setup.flow(settings)
        motions, report = motion_of_log(log, setup.signal_map)
        for motion in motions:
            yield from (one for one in flow.feed(motion) if with_remainders or not one.is_remainder)
        report.require_frames()
        on_read(report)
        yield from (one for one in flow.flush() if with_remainders or not one.is_remainder)


MOST_S: Final = 9e9  # to the year 2255; a little later nanoseconds no longer fit into 64 bits
_NOBODY: Final = Identity()


def estimate_arrays(
    t_s: F64,
    vertical_acceleration_mps2: F64,
    pitch_rate_radps: F64,
    speed_mps: F64,
    calibration: CalibrationFile,
    *,
    roll_rate_radps: F64 | None = None,
    estimator: str | None = None,
    settings: BatchSettings = AS_THE_SERVICE,
) -> list[Estimate]:
    """Every batch of one drive, through the service's pipeline; each index of the arrays is one instant.

    All of shape (n,): times in s since 1970 or any other start, in order; acceleration upwards including gravity; pitch
    rate positive nose down, roll rate left side up (ISO 8855); NaN where a sensor has no sample at that instant.
    ``estimator`` defaults to the file's best. Raises ArraysError for arrays that do not fit together, or an unknown
    estimator.
    """
    chosen = estimator or calibration.estimators[0]
    if chosen not in calibration.estimators:
        raise ArraysError(f"the calibration is for {', '.join(calibration.estimators)}, not for {chosen!r}")
    columns = {
        Signal.VERTICAL_ACCELERATION: vertical_acceleration_mps2,
        Signal.PITCH_RATE: pitch_rate_radps,
        Signal.SPEED: speed_mps,
    }
    if roll_rate_radps is not None:
        columns[Signal.ROLL_RATE] = roll_rate_radps
    motion = _motion(t_s, columns)
    flow = Flow(settings, {}, calibration.for_core(), chosen, _NOBODY)
    return [one for one in (*flow.feed(motion), *flow.flush()) if not one.is_remainder]


def _motion(t_s: F64, columns: Mapping[Signal, F64]) -> Motion:
    """The rows that a decoder would return."""
    times_s = np.asarray(t_s, dtype=np.float64)
    sensed = [np.asarray(column, dtype=np.float64) for column in columns.values()]
    if times_s.ndim != 1 or any(column.shape != times_s.shape for column in sensed):
        shapes = ", ".join(str(column.shape) for column in (times_s, *sensed))
        raise ArraysError(f"times and sensors must be of one length and one dimension; their shapes are {shapes}")
    if not np.isfinite(times_s).all():
        raise ArraysError("a time is not a number")
    if (off := np.abs(times_s) > MOST_S).any():
        raise ArraysError(f"a time is {times_s[off][0]:g} s, past the year 2255: give seconds, not milliseconds")
    t_ns = np.round(times_s * NS_PER_S).astype(np.int64)
    return Motion(tuple(columns), t_ns, np.column_stack(sensed))
