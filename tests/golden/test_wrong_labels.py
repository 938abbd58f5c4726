"""A wrong known load is named: recorded drives, one of them with another label.

That a calibration with such a run is not fit for use: test_calibration_verdict.py.
"""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from support.recordings import recordings

from gateway.calibration.campaign import Campaign, load_campaign
from gateway.calibration.inspection.finding import Kind
from gateway.calibration.inspection.loads import compare_loads
from gateway.calibration.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import front_share_pct
from gateway.offline.campaigns import split_runs

SIX = (1, 3, 5, 6, 7, 9)


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return load_campaign(recordings() / "known_loads/campaign.toml")


@pytest.fixture(scope="module")
def runs(campaign: Campaign) -> list[KnownRun]:
    return [one.identification for one in split_runs(campaign, BatchSettings())]


def named(
    campaign: Campaign, runs: list[KnownRun], wrong: int, payload_kg: float, chosen: Sequence[int]
) -> list[tuple[int, Kind]]:
    """What is found where run ``wrong`` is labelled with this payload, at its place or amidships."""
    place_m = campaign.runs[wrong - 1].payload_position_m or 1.4
    share_pct = front_share_pct(campaign.vehicle, payload_kg, place_m)
    label = {"payload_kg": payload_kg, "front_share_pct": share_pct}
    labelled = [replace(run, **label) if run.number == wrong else run for run in runs if run.number in chosen]
    return [(number, Kind(finding.kind)) for number, finding in compare_loads(labelled, campaign.vehicle)]


@pytest.mark.parametrize(("wrong", "payload_kg"), [(6, 450.0), (1, 60.0)])
def test_the_run_that_was_labelled_wrong_is_named_and_no_other(
    campaign: Campaign, runs: list[KnownRun], wrong: int, payload_kg: float
) -> None:
    assert named(campaign, runs, wrong, payload_kg, range(1, 11)) == [(wrong, Kind.LOAD_DISAGREES)]


@pytest.mark.parametrize("wrong", [1, 5, 6, 9])
def test_whichever_of_six_it_is(campaign: Campaign, runs: list[KnownRun], wrong: int) -> None:
    true_kg = campaign.runs[wrong - 1].payload_kg
    stated_kg = true_kg - 150.0 if true_kg > 200.0 else true_kg + 150.0
    assert named(campaign, runs, wrong, stated_kg, SIX) == [(wrong, Kind.LOAD_DISAGREES)]


def test_six_true_labels_raise_no_doubt(campaign: Campaign, runs: list[KnownRun]) -> None:
    assert list(compare_loads([run for run in runs if run.number in SIX], campaign.vehicle)) == []
