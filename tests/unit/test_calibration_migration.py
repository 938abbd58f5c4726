"""Files of older versions are read: what they said stays, what they did not say is unknown, their id is kept."""

import json
from pathlib import Path

import pytest
from support.calibrated import first_version, second_version

from gateway.calibration.file import load_calibration
from gateway.calibration.file.calibration_file import FIRST_VERSION, MIGRATIONS, VERSION, content_id, migrated
from gateway.core.cross_spectrum.model.parameters import LEAST_SLACK, LEAST_SLACK_ON_CENTRE_LINE
from gateway.core.vehicle import MEASURED_OFFSET_STD_M, UNKNOWN_OFFSET_STD_M

SHIPPED = Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json"


def test_there_is_a_step_from_every_version_to_the_next() -> None:
    assert set(MIGRATIONS) == set(range(FIRST_VERSION, VERSION))


def test_an_old_file_keeps_its_id_and_all_it_said(tmp_path: Path) -> None:
    old = first_version()
    path = tmp_path / "van.json"
    path.write_text(json.dumps(old))
    today = load_calibration(path)
    assert today.version == VERSION
    assert today.id == today.migrated_from == today.for_core().id == old["id"]
    assert today.seen.roughness_mps2 is None
    said = json.loads(today.to_json())
    assert said["expected_errors"] == {"ratio_index": {"payload_rms_kg": None, "front_share_rms_pct": None}}
    assert said["ratio_index"] == old["ratio_index"] | {"roll_lever_m": 0.0}
    for part in ("cross_spectrum", "warnings"):
        assert said[part] == old[part]
    for part in ("seen", "vehicle"):
        assert said[part].items() >= old[part].items()
    run, old_run = said["provenance"].pop("runs")[0], old["provenance"].pop("runs")[0]
    assert said["provenance"] == old["provenance"]
    assert run == old_run | {"payload_left_m": None}


@pytest.mark.parametrize(("offset_m", "std_m"), [(0.0, UNKNOWN_OFFSET_STD_M), (-0.3, MEASURED_OFFSET_STD_M)])
def test_a_file_of_version_2_knows_the_place_of_a_sensor_only_where_one_was_stated(
    tmp_path: Path, offset_m: float, std_m: float
) -> None:
    old = second_version()
    old["vehicle"]["sensor_offset_left_m"] = offset_m
    old["id"] = content_id(old)
    path = tmp_path / "van.json"
    path.write_text(json.dumps(old))
    vehicle = load_calibration(path).for_core().vehicle
    assert (vehicle.sensor_offset_left_m, vehicle.sensor_offset_left_std_m) == (offset_m, std_m)
    assert vehicle.track_width_m is None


def test_a_migrated_file_written_anew_is_read_as_the_same_calibration(tmp_path: Path) -> None:
    path = tmp_path / "van.json"
    path.write_text(json.dumps(first_version()))
    today = load_calibration(path)
    path.write_text(today.to_json())
    again = load_calibration(path)
    assert again.to_json() == today.to_json()
    assert again.id == first_version()["id"]
    assert json.loads(path.read_text())["id"] == again.content_id != again.id


def test_a_damaged_old_file_is_refused_before_it_is_migrated(tmp_path: Path) -> None:
    old = first_version()
    old["vehicle"]["empty_mass_kg"] += 1.0
    path = tmp_path / "van.json"
    path.write_text(json.dumps(old))
    with pytest.raises(Exception, match="does not match its id"):
        load_calibration(path)


def test_migration_leaves_what_it_was_given_alone() -> None:
    old = first_version()
    before = json.dumps(old)
    assert migrated(old, VERSION) is not old
    assert json.dumps(old) == before
    assert migrated(old, 1) is old


def test_the_first_id_is_kept_over_several_migrations() -> None:
    once = {**first_version(), "migrated_from": "sha256:first"}
    assert migrated(once, VERSION)["migrated_from"] == "sha256:first"


def test_the_shipped_calibration_is_of_this_version_and_loads_as_it_is() -> None:
    content = json.loads(SHIPPED.read_text())
    shipped = load_calibration(SHIPPED)
    assert content["version"] == VERSION
    assert (shipped.id, shipped.migrated_from) == (content["id"], None)
    assert shipped.for_core().cross_spectrum is not None
    assert shipped.for_core().ratio_index is not None


def test_what_was_fitted_with_more_slack_keeps_it(tmp_path: Path) -> None:
    content = json.loads(SHIPPED.read_text())
    fitted_anew = load_calibration(SHIPPED).for_core().cross_spectrum
    assert fitted_anew is not None
    assert fitted_anew.ground.least_slack == LEAST_SLACK_ON_CENTRE_LINE
    content["version"] = 5
    del content["cross_spectrum"]["least_slack"], content["cross_spectrum"]["usual_stroke_mps"]
    content["id"] = content_id(content)
    path = tmp_path / "van.json"
    path.write_text(json.dumps(content))
    fitted_then = load_calibration(path).for_core().cross_spectrum
    assert fitted_then is not None
    assert fitted_then.ground.least_slack == LEAST_SLACK


def test_what_was_fitted_with_one_amplitude_for_both_axles_keeps_it(tmp_path: Path) -> None:
    content = json.loads(SHIPPED.read_text())
    fitted_anew = load_calibration(SHIPPED).for_core().cross_spectrum
    assert fitted_anew is not None
    assert fitted_anew.reading.usual_stroke_mps is not None
    content["version"] = 6
    del content["cross_spectrum"]["usual_stroke_mps"]
    content["id"] = content_id(content)
    path = tmp_path / "van.json"
    path.write_text(json.dumps(content))
    fitted_then = load_calibration(path).for_core().cross_spectrum
    assert fitted_then is not None
    assert fitted_then.reading.usual_stroke_mps is None
