"""springscale campaign pack: a campaign as one archive, which calibrates as the folder does."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.commands import printed
from support.encoded import frames_of
from support.known_load_logs import write_known_loads

from gateway.bus.frames import merge_frames
from gateway.bus.logs import open_whole_log, write_candump
from gateway.bus.signals import Encoder, load_signal_map
from gateway.errors import ConfigurationError
from gateway.offline.bundle import CONTRIBUTION, TEMPLATE, pack
from gateway.workbench.simulated_drives import bench_of, write_campaign


def with_strangers(log: Path) -> None:
    """The log with frames that no map names, and with a position."""
    chunks, _ = open_whole_log(log)
    frames = merge_frames(list(chunks))
    stamps = frames.t_ns[::50]
    vin = frames_of((t_ns, 0x7E8, b"VIN12345") for t_ns in stamps)
    place = {"Latitude": np.full(len(stamps), 48.0), "Longitude": np.full(len(stamps), 9.0)}
    here = Encoder(load_signal_map("springscale:reference")).encode("GPS_POSITION", stamps, place)
    write_candump(merge_frames([frames, vin, here]), "can0", log)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    write_campaign(bench_of("experiment", longest_s=130.0), folder)
    for log in folder.glob("*/can.log.gz"):
        with_strangers(log)
    (folder / CONTRIBUTION).write_text(TEMPLATE)
    return folder


@pytest.fixture(scope="module")
def bundle(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("packed") / "van.zip"
    told = json.loads(printed("campaign", "pack", str(folder), "--output", str(output), "--json"))
    assert len(told["runs"]) == 10
    return output


def unpacked(bundle: Path, folder: Path) -> Path:
    """The campaign file of an archive, unpacked into a folder."""
    shutil.unpack_archive(bundle, folder)
    return folder / "campaign.toml"


def test_the_archive_calibrates_and_is_evaluated_as_the_folder(folder: Path, bundle: Path, tmp_path: Path) -> None:
    answers = []
    packed = unpacked(bundle, tmp_path / "unpacked")
    for name, campaign in (("folder", folder / "campaign.toml"), ("bundle", packed)):
        calibration = tmp_path / f"{name}.json"
        options = ["--estimator", "cross_spectrum", "--runs", "1,10", "--window-s", "40"]
        printed("calibrate", str(campaign), "--output", str(calibration), *options)
        told = json.loads(
            printed("evaluate", str(campaign), "--calibration", str(calibration), "--window-s", "40", "--json")
        )
        answers.append([(one["payload_kg"], one["true_payload_kg"], one["rejected"]) for one in told["batches"]])
    assert len(answers[0]) >= 10
    assert answers[0] == answers[1]


def test_only_mapped_frames_leave_the_vehicle(bundle: Path, tmp_path: Path) -> None:
    campaign = unpacked(bundle, tmp_path)
    chunks, _ = open_whole_log(campaign.parent / "runs/01.log.gz")
    assert {int(i) for chunk in chunks for i in np.unique(chunk.can_id)} == {0x120, 0x121, 0x130}


def test_the_position_goes_along_where_it_is_wanted(folder: Path, tmp_path: Path) -> None:
    pack(folder, tmp_path / "van.zip", with_position=True)
    campaign = unpacked(tmp_path / "van.zip", tmp_path / "out")
    chunks, _ = open_whole_log(campaign.parent / "runs/01.log.gz")
    assert 0x131 in {int(i) for chunk in chunks for i in np.unique(chunk.can_id)}


def test_the_same_folder_gives_the_same_bytes(folder: Path, bundle: Path, tmp_path: Path) -> None:
    pack(folder, tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == bundle.read_bytes()


def test_without_permission_nothing_is_packed(tmp_path: Path) -> None:
    write_known_loads(tmp_path, duration_s=100.0)
    with pytest.raises(ConfigurationError, match=r"contribution\.toml: no such file. Write it like this") as refusal:
        pack(tmp_path, tmp_path / "van.zip")
    assert TEMPLATE in str(refusal.value)
    (tmp_path / CONTRIBUTION).write_text(TEMPLATE.replace("may_be_published = true ", "may_be_published = false"))
    with pytest.raises(ConfigurationError, match="may_be_published"):
        pack(tmp_path, tmp_path / "van.zip")
    assert not (tmp_path / "van.zip").exists()


def test_a_map_that_lies_elsewhere_is_named(tmp_path: Path) -> None:
    """The half-car's campaign names a database of the package by its whole path."""
    write_known_loads(tmp_path, duration_s=100.0)
    (tmp_path / CONTRIBUTION).write_text(TEMPLATE)
    with pytest.raises(ConfigurationError, match="lies outside"):
        pack(tmp_path, tmp_path / "van.zip")


def test_the_page_shows_the_template() -> None:
    page = (Path(__file__).parents[2] / "docs/contribute.md").read_text(encoding="utf-8")
    assert f"```toml\n{TEMPLATE}```" in page


def test_existing_files_are_not_overwritten(folder: Path, bundle: Path) -> None:
    before = bundle.read_bytes()
    with pytest.raises(ConfigurationError, match="is there already"):
        pack(folder, bundle)
    assert bundle.read_bytes() == before
