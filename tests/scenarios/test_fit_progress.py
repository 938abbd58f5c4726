"""A fit of many seconds tells how far it is: it was silent until it was done."""

from itertools import pairwise
from pathlib import Path

import pytest
from support.known_load_logs import write_known_loads

from gateway.calibration.calibrate import calibrate_inspected
from gateway.calibration.campaign import load_campaign
from gateway.cli.progress import counted, on_share
from gateway.config import ESTIMATOR_NAMES
from gateway.core.settings import BatchSettings
from gateway.offline.campaigns import inspect

N_RUNS = 4


def test_every_estimator_tells_its_steps(tmp_path: Path) -> None:
    campaign = load_campaign(write_known_loads(tmp_path, duration_s=110.0, identification_fraction=1.0))
    inspection = inspect(campaign, BatchSettings(window_s=100.0))
    told: list[tuple[str, int, int]] = []
    calibrate_inspected(campaign, inspection, estimators=ESTIMATOR_NAMES, on_fit=lambda *step: told.append(step))
    for estimator in ESTIMATOR_NAMES:
        steps = [(done, of) for name, done, of in told if name == estimator]
        assert len(steps) > N_RUNS
        assert {of for _, of in steps} == {steps[-1][0]}
        assert all(before < after for (before, _), (after, _) in pairwise(steps))


def test_the_bar_names_what_is_fitted(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with counted("fitting") as on_step:
        on_part = on_share(on_step, ESTIMATOR_NAMES)
        for name in ESTIMATOR_NAMES:
            on_part(name, 1, 2)
            on_part(name, 2, 2)
    told = capsys.readouterr().err
    assert "fitting cross spectrum" in told
    assert "fitting ratio index" in told
    assert "25%" in told
    assert "100%" in told
