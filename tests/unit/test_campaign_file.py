"""The campaign file: paths and shares follow from it, and each fault is named with its key."""

from pathlib import Path

import pytest

from gateway.calibration.campaign_file import Campaign, load_campaign
from gateway.calibration.fitter_answers import vehicle_table
from gateway.calibration.statements import KNOWN_SHARE_PLUS_MINUS_PCT
from gateway.core.vehicle import MEASURED_OFFSET_STD_M, UNKNOWN_OFFSET_STD_M
from gateway.errors import CampaignError
from gateway.stated.facts import VehicleAnswers

VEHICLE = {"name": '"van"', "empty_mass_kg": "1240.0", "wheelbase_m": "2.8", "sensor_position_m": "3.2"}
EMPTY_RUN = {"log": '"a.log"', "payload_kg": "0.0"}
LOADED_RUN = {"log": '"a.log"', "payload_kg": "270.0", "payload_position_m": "0.5"}


def lines(table: dict[str, str]) -> str:
    return "\n".join(f"{key} = {text}" for key, text in table.items())


def campaign_text(
    head: str = 'signals = "signals.toml"', vehicle: dict[str, str] | None = None, *runs: dict[str, str]
) -> str:
    tables = [head, "[vehicle]", lines(VEHICLE | (vehicle or {}))]
    for run in runs or (EMPTY_RUN, LOADED_RUN):
        tables += ["[[runs]]", lines(run)]
    return "\n".join(tables) + "\n"


def text_of_runs(*runs: dict[str, str]) -> str:
    return campaign_text('signals = "s"', None, *runs)


def written(tmp_path: Path, text: str) -> Path:
    (tmp_path / "a.log").touch()
    path = tmp_path / "campaign.toml"
    path.write_text(text)
    return path


def loaded(tmp_path: Path, text: str) -> Campaign:
    return load_campaign(written(tmp_path, text))


def fault_of(tmp_path: Path, text: str) -> str:
    path = written(tmp_path, text)
    with pytest.raises(CampaignError) as caught:
        load_campaign(path)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())
    return str(caught.value)


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    campaign = loaded(tmp_path, campaign_text())
    assert campaign.signals == str(tmp_path / "signals.toml")
    assert campaign.log_of(campaign.runs[0]) == tmp_path / "a.log"
    assert campaign.identification_fraction == 0.667
    assert loaded(tmp_path, campaign_text('signals = "springscale:aceinna"')).signals == "springscale:aceinna"


def test_axle_weights_give_the_sprung_mass(tmp_path: Path) -> None:
    weights = {"kerb_front_axle_kg": "713.0", "kerb_rear_axle_kg": "704.0"}
    text = campaign_text(vehicle=weights).replace("empty_mass_kg = 1240.0\n", "")
    vehicle = loaded(tmp_path, text).vehicle
    said = VehicleAnswers(
        kerb_front_axle_kg=713.0, kerb_rear_axle_kg=704.0, wheelbase_m=2.8, sensor_position_m=3.2, name="van"
    )
    assert vehicle == vehicle_table(said, "van")
    assert "weigh each axle with the body on it" in fault_of(tmp_path, text.replace("713.0", "20.0"))
    assert "vehicle.empty_mass_kg: missing" in fault_of(tmp_path, text.replace("kerb_rear_axle_kg = 704.0\n", ""))


@pytest.mark.parametrize(
    ("stated", "range_kg", "is_told"),
    [
        ({"gross_limit_kg": "2000.0"}, (0.0, 583.0), True),
        ({"gross_limit_kg": "2000.0", "payload_range_kg": "[0.0, 500.0]"}, (0.0, 500.0), True),
        ({"gross_limit_kg": "1400.0"}, (0.0, 450.0), False),  # less than the empty vehicle weighs
        ({}, (0.0, 450.0), False),
    ],
)
def test_the_gross_limit_and_the_axle_weights_give_the_payload_range(
    tmp_path: Path, stated: dict[str, str], range_kg: tuple[float, float], is_told: bool
) -> None:
    weights = {"kerb_front_axle_kg": "713.0", "kerb_rear_axle_kg": "704.0"}
    campaign = loaded(tmp_path, campaign_text(vehicle=weights | stated))
    assert campaign.vehicle.payload_range_kg == range_kg
    assert campaign.states_payload_range is is_told


def test_a_run_without_a_load_has_an_unknown_load(tmp_path: Path) -> None:
    campaign = loaded(tmp_path, text_of_runs(EMPTY_RUN, {"log": '"a.log"'}))
    run = campaign.drive(2, campaign.runs[1], ())
    assert (run.is_known, run.described) == (False, "an unknown load")
    assert (run.statement.payload_kg, run.statement.front_share_pct, run.statement.source) == (None, None, None)
    assert not run.statement.is_compact


def test_a_load_without_a_place_is_a_note(tmp_path: Path) -> None:
    note = {"log": '"a.log"', "payload_kg": "310.0", "payload_plus_minus_kg": "25.0"}
    campaign = loaded(tmp_path, text_of_runs(note))
    run = campaign.drive(1, campaign.runs[0], ())
    assert (run.is_known, run.described) == (False, "310 kg")
    assert (run.statement.payload_kg, run.statement.payload_plus_minus_kg) == (310.0, 25.0)
    assert run.statement.front_share_pct is None
    assert not run.statement.is_compact


def test_the_doubt_of_a_place_is_that_of_the_share(tmp_path: Path) -> None:
    """0.28 m of a wheelbase of 2.8 m move a tenth of the payload from one axle to the other."""
    rough = loaded_run(payload_position_plus_minus_m="0.28")
    campaign = loaded(tmp_path, text_of_runs(rough, LOADED_RUN))
    doubtful, usual = (campaign.drive(i, run, ()).statement for i, run in enumerate(campaign.runs, 1))
    assert doubtful.front_share_plus_minus_pct == pytest.approx(100.0 * 27.0 / 1510.0)
    assert usual.front_share_plus_minus_pct == KNOWN_SHARE_PLUS_MINUS_PCT
    assert usual.is_compact


def test_a_sensor_whose_place_to_the_side_is_not_stated_is_unsure(tmp_path: Path) -> None:
    def placed(**keys: str) -> tuple[float, float]:
        vehicle = loaded(tmp_path, campaign_text(vehicle=keys)).vehicle
        return vehicle.sensor_left_m, vehicle.sensor_left_std_m

    assert placed() == (0.0, UNKNOWN_OFFSET_STD_M)
    assert placed(sensor_offset_left_m="0.0") == (0.0, MEASURED_OFFSET_STD_M)
    assert placed(sensor_offset_left_m="-0.3") == (-0.3, MEASURED_OFFSET_STD_M)
    assert placed(sensor_offset_left_m="0.3", sensor_offset_left_std_m="0.05") == (0.3, 0.05)
    assert placed(sensor_offset_left_std_m="0.5") == (0.0, 0.5)


def of_vehicle(**keys: str) -> str:
    return campaign_text(vehicle=keys)


def loaded_run(**keys: str) -> dict[str, str]:
    return LOADED_RUN | keys


FAULTS = [
    (campaign_text('signals = "s"\ncolour = 1'), "colour: unknown key"),
    (campaign_text('signals = ""'), "signals: "),
    (campaign_text('signals = "s"\nidentification_fraction = 1.5'), "identification_fraction: "),
    (of_vehicle(doors="5"), "vehicle.doors: unknown key"),
    (of_vehicle(wheelbase_m="0.0"), "vehicle.wheelbase_m: "),
    (of_vehicle(empty_mass_kg='"heavy"'), "vehicle.empty_mass_kg: "),
    (of_vehicle(empty_front_share_pct="0.5e3"), "vehicle.empty_front_share_pct: "),
    (of_vehicle(payload_range_kg="[450.0, 0.0]"), "payload_range_kg must rise"),
    (of_vehicle(carries='"elephants"'), "vehicle.carries"),
    (
        text_of_runs({"log": '"a.log"', "payload_position_m": "0.5"}),
        "payload_position_m says nothing without payload_kg: state it, or leave both out",
    ),
    (text_of_runs(loaded_run(payload_plus_minus_kg="0")), "payload_plus_minus_kg: "),
    (text_of_runs(EMPTY_RUN, loaded_run(payload_kg="-5.0")), "runs[2].payload_kg: "),
    (text_of_runs(loaded_run(front_share_pct="48.0")), "not both"),
    (text_of_runs(EMPTY_RUN | {"start_s": "9.0", "end_s": "5.0"}), "end_s must be after"),
    (text_of_runs(EMPTY_RUN | {"split": '"test"'}), "runs[1].split: "),
    (text_of_runs(EMPTY_RUN, loaded_run(log='"b.log"')), "runs[2].log: b.log: no such"),
    (of_vehicle(wheelbase_m="2800"), "vehicle.wheelbase_m: "),
    (of_vehicle(empty_mass_kg="1.24"), "vehicle.empty_mass_kg: "),
    (of_vehicle(sensor_position_m="320"), "vehicle.sensor_position_m: "),
    (text_of_runs({"log": '"a.log"', "payload_kg": "9", "front_share_pct": "0.5"}), "_pct: "),
    (text_of_runs(EMPTY_RUN, loaded_run(payload_position_m="500")), "_position_m: "),
    (text_of_runs(EMPTY_RUN, loaded_run(payload_position_m="13")), "lift the other"),
    (text_of_runs(loaded_run(payload_kg="0.27")), "write 270 if these are tonnes"),
    (text_of_runs(loaded_run(payload_kg="1.3")), "write 1300 if these are tonnes"),
    (of_vehicle(payload_range_kg="[0.0, 0.45]"), "vehicle.payload_range_kg: 0.45 kg is no load"),
    (of_vehicle(track_width_m="1500"), "vehicle.track_width_m: 1500 is above 4: millimetres?"),
    (of_vehicle(sensor_offset_left_m="-300"), "vehicle.sensor_offset_left_m: -300 is below -2: millimetres?"),
    (of_vehicle(sensor_offset_left_std_m="20"), "vehicle.sensor_offset_left_std_m: 20 is above 2"),
    # the square of 1e-320 is 0, and a fit cannot divide by it
    (of_vehicle(sensor_position_std_m="1e-320"), "vehicle.sensor_position_std_m: 1e-320 is below 0.001"),
    (of_vehicle(sensor_offset_left_std_m="1e-320"), "vehicle.sensor_offset_left_std_m: 1e-320 is below 0.001"),
    (text_of_runs(loaded_run(payload_left_m="35")), "runs[1].payload_left_m: 35 is above 2: centimetres?"),
    (
        campaign_text('signals = "s"', {"track_width_m": "0.6"}, loaded_run(payload_left_m="-1.8")),
        "runs[1].payload_left_m: 270 kg at -1.8 m would put -4 % of the weight on the left wheels",
    ),
    (of_vehicle(gross_limit_kg="inf"), "vehicle.gross_limit_kg: Input should be a finite number"),
    (text_of_runs(EMPTY_RUN | {"end_s": "inf"}), "runs[1].end_s: Input should be a finite"),
    (
        of_vehicle(kerb_rear_axle_kg="600.0"),
        "vehicle.kerb_rear_axle_kg: is 20 kg less than the load on this axle by empty_mass_kg",
    ),
    ('signals = "s"\n[vehicle]\n' + lines(VEHICLE), "runs: missing"),
    ('signals = "s"\nruns = []\n[vehicle]\n' + lines(VEHICLE), "runs: "),
    ("signals = \n", "line 1"),
]


@pytest.mark.parametrize(("text", "said"), FAULTS)
def test_each_fault_is_named(tmp_path: Path, text: str, said: str) -> None:
    assert said in fault_of(tmp_path, text)


def test_all_faults_are_named_at_once(tmp_path: Path) -> None:
    text = campaign_text('signals = ""', {"wheelbase_m": "-1.0"}, EMPTY_RUN | {"payload_kg": "-1"})
    faults = fault_of(tmp_path, text)
    assert len(faults.splitlines()) == 3


def test_a_fault_in_the_only_run_is_reported_as_itself(tmp_path: Path) -> None:
    assert fault_of(tmp_path, text_of_runs(EMPTY_RUN | {"end_s": "-1.0"})).count("\n") == 0


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"absent\.toml: no such file"):
        load_campaign(tmp_path / "absent.toml")
    with pytest.raises(CampaignError, match="is a folder"):
        load_campaign(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b'signals = "\xe9"')
    with pytest.raises(CampaignError, match="not UTF-8"):
        load_campaign(tmp_path / "latin.toml")
