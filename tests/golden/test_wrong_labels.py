"""A wrong known load is named: recorded drives, one of them with another label, or two with each other's."""

from collections.abc import Sequence

import pytest
from support.recordings import recordings

from gateway.calibration.campaign_file import Campaign, load_campaign
from gateway.calibration.found import ClaimState
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.calibration.teach import examined
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import front_share_pct
from gateway.offline.campaigns import split_runs

SIX = (1, 3, 5, 6, 7, 9)
TEN = tuple(range(1, 11))
Label = tuple[float, float]  # payload in kg, metres behind the front axle


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    return load_campaign(recordings() / "known_loads/campaign.toml")


@pytest.fixture(scope="module")
def runs(campaign: Campaign) -> list[StatedDrive]:
    return [one.identification for one in split_runs(campaign, BatchSettings())]


def held(campaign: Campaign, runs: Sequence[StatedDrive], chosen: Sequence[int], labels: dict[int, Label]) -> set[int]:
    """The runs whose statements are held where some are labelled so."""
    said = [
        known_drive(run.number, run.log, label[0], front_share_pct(campaign.vehicle, *label), run.batches)
        if (label := labels.get(run.number))
        else run
        for run in runs
        if run.number in chosen
    ]
    found = examined(said, campaign.vehicle, None)
    return {int(one.drive.split()[1]) for one in found if one.state is ClaimState.HELD}


@pytest.mark.parametrize(
    ("chosen", "labels"),
    [
        pytest.param(SIX, {}, id="true labels"),
        pytest.param(TEN, {6: (450.0, 1.3)}, id="180 kg too much among ten"),
        pytest.param(TEN, {1: (60.0, 1.4)}, id="60 kg aboard an empty one"),
        pytest.param(SIX, {1: (150.0, 1.4)}, id="150 kg aboard an empty one"),
        pytest.param(SIX, {5: (120.0, 0.5)}, id="150 kg too little in front"),
        pytest.param(SIX, {6: (120.0, 1.3)}, id="150 kg too little amidships"),
        pytest.param(SIX, {9: (270.0, 1.3)}, id="150 kg too little of the largest"),
        pytest.param(TEN, {6: (270.0, 2.8)}, id="another place"),
        pytest.param(TEN, {2: (420.0, 2.8), 10: (120.0, 0.5)}, id="two exchanged"),
    ],
)
def test_only_wrong_labels_are_held(
    campaign: Campaign, runs: list[StatedDrive], chosen: tuple[int, ...], labels: dict[int, Label]
) -> None:
    assert held(campaign, runs, chosen, labels) == set(labels)


def test_true_labels_of_drives_of_several_days_are_believed() -> None:
    """Springs, dampers and tyres differ from day to day, and some loads stand on soft mounts."""
    campaign = load_campaign(recordings() / "mixed/campaign.toml")
    runs = [one.validation for one in split_runs(campaign, BatchSettings())]
    assert held(campaign, runs, range(1, 9), {}) == set()
