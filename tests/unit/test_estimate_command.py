"""`estimate` where it weighed nothing: why, what to do, and the likely cause."""

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from support.estimates import make_estimate, posterior_of

import gateway.cli.estimate as command
from gateway.cli import springscale
from gateway.errors import SpringscaleError
from gateway.estimate import Estimate
from gateway.records import Why

DEMO = str(files("gateway") / "demo" / "paper_van.json")


def said(monkeypatch: pytest.MonkeyPatch, log: Path, *batches: Estimate) -> SpringscaleError | None:
    """What the command ends with where the log holds these batches; None: it ends well."""

    def weighed(*_: Any, **__: Any) -> Iterator[Estimate]:
        yield from batches

    monkeypatch.setattr(command, "with_remainders", weighed)
    done = CliRunner().invoke(
        springscale, ["estimate", str(log), "--signals", "springscale:reference", "--calibration", DEMO]
    )
    assert done.exception is None or isinstance(done.exception, SpringscaleError), done.exception
    return done.exception


@pytest.fixture
def log(tmp_path: Path) -> Path:
    (tmp_path / "drive.log").write_text("")
    return tmp_path / "drive.log"


def test_another_vehicles_calibration_is_named_as_the_likely_cause(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    """Where most batches moved as another vehicle does."""
    unlike = (make_estimate(0, Why.MODEL_MISFIT), make_estimate(1, Why.OUT_OF_RANGE), make_estimate(2, Why.TOO_SLOW))
    fault = said(monkeypatch, log, *unlike)
    assert fault is not None
    assert fault.exit_code == 1
    assert "model_misfit (1 batch): no payload and front share explain these spectra" in str(fault)
    assert "What to do: make sure that the calibration is this vehicle's" in str(fault)
    likely = (
        "The likely cause: this is not the log of the vehicle that was calibrated, paper_van (wheelbase 2.8 m, 1240 kg"
    )
    assert likely in str(fault)


def test_what_the_road_or_a_sensor_did_is_not_laid_on_the_calibration(
    monkeypatch: pytest.MonkeyPatch, log: Path
) -> None:
    slow = (
        make_estimate(0, Why.TOO_SLOW),
        make_estimate(1, Why.ACCELERATION_STUCK),
        make_estimate(2, Why.MODEL_MISFIT),
    )
    fault = said(monkeypatch, log, *slow)
    assert fault is not None
    assert "nothing was weighed" in str(fault)
    assert "likely cause" not in str(fault)


def test_one_batch_that_was_weighed_is_enough(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    answer = make_estimate(1).answered(posterior_of(270.0, 48.0, 6.0, 0.2))
    assert said(monkeypatch, log, make_estimate(0, Why.MODEL_MISFIT), answer) is None
