"""The calibration file: what is written is read back, and nothing else is believed."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.calibrated import calibration_file

import gateway
from gateway.calibration.file import load_calibration
from gateway.errors import CalibrationFileError

SHIPPED = Path(gateway.__file__).parent / "demo" / "paper_van.json"
Change = Callable[[dict[str, Any]], Any]


def written(tmp_path: Path, change: Change | None = None, text: str | None = None) -> Path:
    """The made-up file, or another, changed."""
    content = json.loads(text or calibration_file().to_json())
    if change:
        change(content)
    path = tmp_path / "van.json"
    path.write_text(json.dumps(content))
    return path


def fault_of(path: Path) -> str:
    with pytest.raises(CalibrationFileError) as caught:
        load_calibration(path)
    assert str(path) in str(caught.value)
    assert caught.value.exit_code == 2
    return str(caught.value)


def test_round_trip(tmp_path: Path) -> None:
    original = calibration_file()
    path = tmp_path / "van.json"
    path.write_text(original.to_json())
    again = load_calibration(path)
    assert again.to_json() == original.to_json()
    assert again.id == original.id == "sha256:" + hashlib.sha256(path.read_bytes()).hexdigest()
    core, core_again = original.for_core(), again.for_core()
    assert core_again.vehicle == core.vehicle
    for name in ("payload", "front_share"):
        model, same = (getattr(one.ratio_index, name) for one in (core, core_again))
        assert same.predict(0.9, 1.2) == model.predict(0.9, 1.2)
    assert core_again.ratio_index.acceleration_bands == core.ratio_index.acceleration_bands


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_file_that_was_cut_short_is_refused(tmp_path: Path, share: float) -> None:
    path = written(tmp_path)
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    assert "was cut short; restore it or calibrate again" in fault_of(path)


def test_a_damaged_byte_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_bytes(path.read_bytes().replace(b'"vehicle"', b'"veh\xffcle"'))
    assert "cannot be read" in fault_of(path)


FAULTS: list[tuple[Change, str]] = [
    (lambda c: c.update(version=2), "version 2, this springscale reads version 1: calibrate again"),
    (lambda c: c.update(version=0), "version 0, this springscale reads version 1: calibrate again"),
    (lambda c: c.update(version="1"), "version '1', this springscale reads version 1"),
    (lambda c: c.pop("version"), "version None, this springscale reads version 1"),
    (lambda c: c.update(seen=[]), "seen: "),
    (lambda c: c.update(format="else"), "not a springscale calibration file"),
    (lambda c: c.update(colour="red"), "colour: unknown key"),
    (lambda c: c["vehicle"].update(doors=5), "vehicle.doors: unknown key"),
    (lambda c: c["vehicle"].pop("wheelbase_m"), "vehicle.wheelbase_m: missing"),
    (lambda c: c["vehicle"].update(empty_mass_kg=-1.0), "vehicle.empty_mass_kg"),
    (lambda c: c["ratio_index"]["payload"].update(residual_std=0.0), "ratio_index.payload.residual_std"),
    (lambda c: c["ratio_index"].update(n_segment=8), "ratio_index.n_segment"),
]


@pytest.mark.parametrize(("change", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_what_is_wrong_is_named(tmp_path: Path, change: Change, said: str) -> None:
    assert said in fault_of(written(tmp_path, change))


def _spread(content: dict[str, Any], fill: Callable[[tuple[int, int]], Any]) -> None:
    n = len(content["cross_spectrum"]["names"])
    content["cross_spectrum"]["covariance"] = fill((n, n)).tolist()


ABSURD: list[tuple[Change, str]] = [
    (lambda c: c.update(table="0" * 16), "another vehicle model than this springscale has: calibrate again"),
    (lambda c: c["cross_spectrum"].update(band_hz=[0.0, 0.0]), "cross_spectrum.band_hz is [0.0, 0.0]"),
    (lambda c: c["cross_spectrum"].update(band_hz=[15.0, 1.0]), "cross_spectrum.band_hz"),
    (lambda c: c["cross_spectrum"].update(speed_seen_mps=[0.0, 0.0]), "cross_spectrum.speed_seen_mps"),
    (lambda c: _spread(c, np.zeros), "cross_spectrum.covariance is an array of"),
    (lambda c: _spread(c, np.ones), "positive definite"),
    (lambda c: c["cross_spectrum"]["parameters"].__setitem__(0, 900.0), "cross_spectrum.parameters"),
    (lambda c: c["cross_spectrum"].update(taught_loads=[]), "no drive taught this vehicle"),
    (lambda c: c["cross_spectrum"].update(spread=[1.0, 1.0, 90.0]), "cross_spectrum.spread is [1.0, 1.0, 90.0]"),
    (lambda c: c["ratio_index"].update(acceleration_bands=[[0.0, 0.0], [2.0, 0.1]]), "ratio_index.acceleration_bands"),
    (lambda c: c["ratio_index"].update(speed_range_mps=[0.0, 0.0]), "ratio_index.speed_range_mps"),
    (lambda c: c["vehicle"].update(wheelbase_m=3000.0), "vehicle.wheelbase_m: 3000.0 is above 20: millimetres?"),
    (lambda c: c["seen"].update(payload_kg=[400.0, 0.0]), "seen.payload_kg"),
    # edited by hand in one of two places, they gave weights that were wrong by as much
    (lambda c: c["vehicle"].update(empty_mass_kg=1340.0), "vehicle.empty_mass_kg is 1340.0, but the springs"),
    (lambda c: c["vehicle"].update(wheelbase_m=3.4), "vehicle.wheelbase_m is 3.4, but the springs"),
    (lambda c: c["cross_spectrum"].update(track_width_m=2.1), "the springs were fitted with 2.1"),
    (lambda c: c["cross_spectrum"].update(empty_front_share_pct=61.0), "the springs were fitted with 61.0"),
]


@pytest.mark.parametrize(("change", "said"), ABSURD, ids=[said for _, said in ABSURD])
def test_numbers_of_no_vehicle_are_refused_by_name(tmp_path: Path, change: Change, said: str) -> None:
    """They reached the model, and printed pages of warnings."""
    assert said in fault_of(written(tmp_path, change, SHIPPED.read_text()))


@pytest.mark.parametrize(("text", "said"), [("{", "not valid JSON"), ("[1]", "not a springscale calibration file")])
def test_what_is_no_calibration_file_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "van.json"
    path.write_text(text)
    assert said in fault_of(path)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    assert "no such calibration file" in fault_of(tmp_path / "absent.json")
    assert "cannot be read" in fault_of(tmp_path)


def test_a_file_that_lacks_an_optional_field_keeps_the_id_it_was_stored_under(tmp_path: Path) -> None:
    """Statements and estimates name it by this id, whatever fields today's files have besides."""
    path = written(tmp_path, lambda c: c.pop("sister_id"))
    stored = "sha256:" + hashlib.sha256(path.read_bytes()).hexdigest()
    assert stored != calibration_file().id
    held = load_calibration(path)
    assert held.id == held.for_core().id == stored
    again = tmp_path / "again.json"
    again.write_text(held.to_json())
    assert load_calibration(again).id == stored
