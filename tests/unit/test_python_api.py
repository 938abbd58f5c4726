"""import gateway: cheap, a few public names, and arrays are weighed as the service weighs frames."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import springscale
from support.drives import T0_NS, drive, steady

import gateway
from gateway.errors import ArraysError
from gateway.estimates.as_json import COLUMNS
from gateway.records import Motion, Signal
from gateway.weighing.flow import Flow, Identity

PAPER_VAN = str(files("gateway") / "demo" / "paper_van.json")
SENSED = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED)


@pytest.fixture(scope="module")
def calibration() -> gateway.CalibrationFile:
    return gateway.load_calibration(PAPER_VAN)


@pytest.fixture(scope="module")
def motion() -> Motion:
    """Rows as decoded, in seconds since the drive's start so that no nanosecond is lost in a float."""
    rows = drive(330.0, steady(14.0))
    order = [rows.signals.index(signal) for signal in SENSED]
    return Motion(SENSED, rows.t_ns - T0_NS, rows.columns[:, order])


def test_springscale_is_the_same_package_under_the_name_that_users_know() -> None:
    assert springscale.load_calibration is gateway.load_calibration
    assert set(springscale.__all__) == set(gateway.__all__)
    assert set(dir(springscale)) == set(dir(gateway))


def test_every_public_name_exists_and_is_documented() -> None:
    page = (Path(__file__).parents[2] / "docs/api.md").read_text()
    assert [name for name in gateway.__all__ if getattr(gateway, name, None) is None] == []
    assert [name for name in gateway.__all__ if f"`{name}" not in page] == []
    assert set(gateway.__all__) <= set(dir(gateway))
    assert set(gateway.__all__) == set(gateway._HOMES)
    with pytest.raises(AttributeError, match="nothing"):
        _ = gateway.nothing


def test_arrays_are_weighed_as_rows_of_a_bus_are(motion: Motion, calibration: gateway.CalibrationFile) -> None:
    flow = Flow(gateway.BatchSettings(), {}, calibration.for_core(), "cross_spectrum", Identity())
    told = [one for one in (*flow.feed(motion), *flow.flush()) if not one.is_remainder]
    found = gateway.estimate_arrays(motion.t_ns / 1e9, *motion.columns.T, calibration, estimator="cross_spectrum")
    assert len(found) > 0
    assert [gateway.estimate_to_json(each) for each in found] == [gateway.estimate_to_json(each) for each in told]


def test_a_roll_rate_is_welcome_and_must_fit(motion: Motion, calibration: gateway.CalibrationFile) -> None:
    roll_rate = 0.01 * np.sin(motion.t_ns / 1e9)
    told = gateway.estimate_arrays(motion.t_ns / 1e9, *motion.columns.T, calibration, roll_rate_radps=roll_rate)
    assert [each.t_end_ns for each in told] == [300_000_000_000]
    with pytest.raises(ArraysError, match="shapes"):
        gateway.estimate_arrays(motion.t_ns / 1e9, *motion.columns.T, calibration, roll_rate_radps=roll_rate[1:])


def test_a_row_of_a_table_has_every_column(motion: Motion, calibration: gateway.CalibrationFile) -> None:
    first, *_ = gateway.estimate_arrays(motion.t_ns / 1e9, *motion.columns.T, calibration)
    row = gateway.table_row(first)
    assert tuple(row) == COLUMNS
    assert row["calibration_id"] == calibration.id


@pytest.mark.parametrize(
    ("t_s", "speed_mps", "said"),
    [
        (np.arange(3.0), np.zeros(2), r"shapes are \(3,\), \(3,\), \(3,\), \(2,\)"),
        (np.zeros((3, 1)), np.zeros(3), "one dimension"),
        (np.array([0.0, np.nan, 1.0]), np.zeros(3), "not a number"),
        (1e3 * (1.79e9 + np.arange(3.0)), np.zeros(3), r"a time is 1.79e\+12 s, past the year 2255: give seconds"),
        (np.array([0.0, -1e10, 1.0]), np.zeros(3), r"a time is -1e\+10 s"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(
    t_s: np.ndarray, speed_mps: np.ndarray, said: str, calibration: gateway.CalibrationFile
) -> None:
    with pytest.raises(ArraysError, match=said):
        gateway.estimate_arrays(t_s, np.zeros(3), np.zeros(3), speed_mps, calibration)


def test_an_estimator_that_the_file_lacks_is_refused(calibration: gateway.CalibrationFile) -> None:
    with pytest.raises(ArraysError, match="not for 'scales'"):
        gateway.estimate_arrays(*np.zeros((4, 3)), calibration, estimator="scales")
