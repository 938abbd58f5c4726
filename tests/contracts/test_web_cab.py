"""/api/v1/cab: room, light, age and what is not known, as the cab page shows them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.cab import BEFORE, VAN, cab_gateway, load_event, loaded, vaguely_loaded
from support.estimates import posterior_of
from support.web import Client, Gateway

from gateway.core.fusion import epoch_of
from gateway.records import Why
from gateway.status import AlarmsStatus, OwnReading, Standing, State
from gateway.weighing.calibrated import CalibratedVehicle


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with cab_gateway(tmp_path) as opened:
        yield opened


def told(gateway: Gateway) -> dict[str, Any]:
    return Client(gateway.app).get("/api/v1/cab").json()


def test_room_counts_the_levers_of_both_axles_and_says_where(gateway: Gateway) -> None:
    """300 kg, 48 % in front: 819 and 881 kg on the axles. The rear axle may bear 169.2 kg more, which are 225.6 kg in
    the front half of the loading area, where it bears at most three quarters of them.
    """
    gateway.publish(loaded(0, 300.0, 48.0))
    cab = told(gateway)
    assert cab["room"]["kg"] == 225.6
    assert cab["room"]["plus_minus_kg"] == pytest.approx(1.96 * 4.5 / 0.75, rel=0.1)
    assert cab["room"]["safe"]["rear_half_kg"] == 0.0
    assert cab["room"]["safe"]["front_half_kg"] == pytest.approx(225.6 - cab["room"]["plus_minus_kg"], abs=0.2)
    assert cab["room"]["is_anywhere"] is False
    assert cab["room"]["take_out"] == {"front_half_kg": 0.0, "rear_half_kg": 0.0}
    assert [spare["place"] for spare in cab["spare"]] == ["rear_axle", "front_axle", "gross"]
    told_kg = {"kg": 300.0, "std_kg": 6.0, "interval95_kg": [288.2, 311.8], "limit_kg": 2000.0}
    assert cab["spare"][2] == {"place": "gross", **told_kg}
    assert cab["spare"][0]["kg"] == 169.2
    assert (cab["light"], cab["says"], cab["light_about"], cab["has_limits"]) == ("go", "go", [], True)
    assert cab["over_limit_probability"] < 1e-3
    assert (cab["payload_kg"], cab["payload_interval95_kg"]) == (300.0, [288.2, 311.8])
    assert (cab["load"], cab["age_s"], cab["is_stale"], cab["is_early"]) == ("weighed", 0.0, False, False)
    assert cab["vehicle_id"] == "van-17"


@pytest.mark.parametrize("payload_kg", [300.0, 592.0, 620.0])
def test_dashboard_and_cab_page_tell_one_verdict(gateway: Gateway, payload_kg: float) -> None:
    gateway.publish(loaded(0, payload_kg, 50.0))
    verdict = Client(gateway.app).get("/api/v1/weights/latest").json()["verdict"]
    assert verdict == {name: told(gateway)[name] for name in verdict}


def test_after_unloading_an_alarm_that_is_still_active_makes_the_light_amber(gateway: Gateway) -> None:
    """Not green beside the alarm: the first value after unloading is below the limit, no full batch is yet."""
    gateway.publish(loaded(0, 620.0, 50.0))
    gateway.status = BEFORE.model_copy(update={"alarms": AlarmsStatus(active=("overload.gross",))})
    assert (told(gateway)["light"], told(gateway)["says"]) == ("over", "over")
    gateway.board.publish(replace(loaded(9, 300.0, 48.0), is_provisional=True))
    cab = told(gateway)
    assert (cab["light"], cab["says"], cab["light_about"]) == ("near", "was_over", ["gross"])
    gateway.status = BEFORE
    assert (told(gateway)["light"], told(gateway)["says"]) == ("go", "go")


def test_vehicle_that_has_just_been_calibrated_is_ready_and_not_uncalibrated(tmp_path: Path) -> None:
    """The batch of before was refused for lack of a calibration."""
    with cab_gateway(tmp_path) as opened:
        opened.publish(loaded(0, 300.0, 48.0).refused(Why.NO_CALIBRATION))
        cab = told(opened)
        assert (cab["says"], cab["rejected"], cab["lacks"]) == ("ready", [], "estimate")
        opened.status = BEFORE.model_copy(update={"calibration_id": None})
        assert (told(opened)["says"], told(opened)["rejected"]) == ("not_calibrated", ["no_calibration"])


def test_all_batches_of_the_load_count_together(gateway: Gateway) -> None:
    one = replace(loaded(0, 300.0, 48.0), epoch=epoch_of(posterior_of(290.0, 48.0, 3.0, 0.1), 4))
    gateway.publish(one)
    cab = told(gateway)
    assert cab["spare"][2]["kg"] == 310.0
    assert cab["spare"][2]["std_kg"] == 3.0
    assert cab["payload_interval95_kg"] == [284.1, 295.9]


def test_the_light_turns_and_names_its_places(gateway: Gateway) -> None:
    lights = []
    for n, payload_kg in enumerate([300.0, 592.0, 620.0]):
        gateway.publish(loaded(n, payload_kg, 50.0))
        cab = told(gateway)
        lights.append((cab["light"], cab["light_about"]))
    assert lights == [("go", []), ("near", ["front_axle", "gross"]), ("over", ["gross", "front_axle"])]
    assert told(gateway)["over_limit_probability"] > 0.99
    assert [spare["kg"] for spare in told(gateway)["spare"]] == [-20.0, -10.0, 40.0]
    assert told(gateway)["room"]["kg"] == -20.0


def test_standing_and_an_unweighed_load_are_shown(gateway: Gateway) -> None:
    gateway.publish(loaded(0, 300.0, 48.0))
    gateway.status = BEFORE.model_copy(update={"standing": Standing(stood_s=95.04), "state": State.WAITING_FOR_SPEED})
    cab = told(gateway)
    assert (cab["load"], cab["stood_s"], cab["state"]) == ("standing", 95.0, "waiting_for_speed")
    gateway.status = BEFORE.model_copy(update={"standing": Standing(is_load_weighed=False)})
    assert told(gateway)["load"] == "not_weighed_yet"
    assert told(gateway)["room"] is not None  # as it was weighed before


def test_before_the_first_estimate_everything_is_unknown(gateway: Gateway) -> None:
    cab = told(gateway)
    assert (cab["load"], cab["light"], cab["room"], cab["payload_kg"]) == ("never_weighed", "unknown", None, None)
    assert (cab["says"], cab["spare"]) == ("ready", [])
    assert (cab["lacks"], cab["last_event"], cab["t_end"], cab["rejected"]) == ("estimate", None, None, [])


def test_refusals_since_the_last_answer_are_shown_with_their_reasons(gateway: Gateway) -> None:
    gateway.publish(loaded(0, 300.0, 48.0), loaded(1, 300.0, 48.0).refused(Why.TOO_SLOW, Why.GAP))
    assert told(gateway)["rejected"] == ["too_slow", "gap"]
    gateway.publish(loaded(2, 300.0, 48.0))
    assert told(gateway)["rejected"] == []


@pytest.mark.parametrize("why", [Why.MODEL_MISFIT, Why.ACCELERATION_STUCK])
def test_no_room_is_promised_while_batches_are_refused(gateway: Gateway, why: Why) -> None:
    """Neither by what was weighed before, nor by early looks between refused batches."""
    early = replace(loaded(9, 310.0, 48.0), is_provisional=True)
    gateway.publish(loaded(0, 300.0, 48.0), loaded(1, 300.0, 48.0).refused(why))
    for payload_kg in (300.0, 310.0):
        cab = told(gateway)
        assert (cab["light"], cab["room"], cab["is_doubted"], cab["rejected"]) == ("unknown", None, True, [str(why)])
        assert cab["payload_kg"] == payload_kg
        gateway.board.publish(early)
    gateway.publish(loaded(9, 300.0, 48.0))
    assert (told(gateway)["light"], told(gateway)["is_doubted"]) == ("go", False)


def test_a_useless_road_changes_nothing_and_doubt_never_clears_an_overload(gateway: Gateway) -> None:
    gateway.publish(loaded(0, 300.0, 48.0), loaded(1, 300.0, 48.0).refused(Why.NOT_ENOUGH_EXCITATION))
    assert (told(gateway)["light"], told(gateway)["is_doubted"]) == ("go", False)
    gateway.publish(loaded(2, 620.0, 50.0), loaded(3, 620.0, 50.0).refused(Why.MODEL_MISFIT))
    assert (told(gateway)["light"], told(gateway)["rejected"]) == ("over", ["model_misfit"])


def test_an_early_look_and_an_old_number_are_marked(gateway: Gateway) -> None:
    gateway.publish(loaded(0, 300.0, 48.0))
    gateway.clock_s += 3600.0
    assert (told(gateway)["age_s"], told(gateway)["is_stale"], told(gateway)["is_early"]) == (3600.0, True, False)
    gateway.restart_board()
    gateway.board.publish(replace(loaded(0, 300.0, 48.0), is_provisional=True))
    assert told(gateway)["is_early"] is True


def test_missing_limits_or_calibration_are_named(tmp_path: Path) -> None:
    unlimited = replace(VAN.vehicle, gross_limit_kg=None, front_axle_limit_kg=None, rear_axle_limit_kg=None)
    for n, calibrated in enumerate([replace(VAN, vehicle=unlimited), None]):
        with Gateway(tmp_path / str(n), calibrated=calibrated) as opened:
            opened.publish(loaded(0, 300.0, 48.0))
            cab = told(opened)
        assert (cab["room"], cab["light"], cab["has_limits"]) == (None, "unknown", False)
        assert cab["lacks"] == (None if isinstance(calibrated, CalibratedVehicle) else "calibration")


def test_the_latest_load_event_is_shown_unless_withdrawn(gateway: Gateway) -> None:
    load_event(gateway, 100, 240.0)
    load_event(gateway, 200, -180.0)
    load_event(gateway, 50, 20.0)  # of earlier, corrected later
    load_event(gateway, 300, 12.0, is_withdrawn=True)
    last = told(gateway)["last_event"]
    assert (last["change_kg"], last["payload_kg"], last["probability"]) == (-180.0, 500.0, 0.999)
    assert last["t_end"] == "1970-01-01T00:03:20.000000Z"


def test_active_alarms_and_readings_of_the_vehicles_own_sensors_are_passed_on(gateway: Gateway) -> None:
    assert told(gateway)["alarms"] == []
    active = ("overload.gross", "sensor_fault.silent")
    reading = OwnReading(signal="air_spring_pressure", number=412.0, unit="kPa", age_s=0.4)
    gateway.status = BEFORE.model_copy(update={"alarms": AlarmsStatus(active=active), "own_readings": (reading,)})
    assert (told(gateway)["alarms"], told(gateway)["own_readings"]) == (list(active), [reading.model_dump()])


@pytest.mark.parametrize(("of_useful", "light", "says"), [(0.9, "go", "go"), (1.1, "unknown", "vague")])
def test_nothing_is_green_while_the_payload_is_not_known_exactly_enough(
    gateway: Gateway, of_useful: float, light: str, says: str
) -> None:
    """100 kg aboard, 500 kg below the limit: sure enough not to be too heavy, and yet a weighing of no use."""
    gateway.publish(vaguely_loaded(0, 100.0, of_useful))
    cab = told(gateway)
    assert (cab["light"], cab["says"], cab["light_about"]) == (light, says, [])
    assert (cab["room"] is None, cab["spare"] == []) == ((says == "vague"), (says == "vague"))
    assert cab["payload_kg"] == 100.0
    verdict = Client(gateway.app).get("/api/v1/weights/latest").json()["verdict"]
    assert (verdict["light"], verdict["says"]) == (light, says)
