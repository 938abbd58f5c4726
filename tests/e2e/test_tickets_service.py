"""A ticket at a running service: the calibration it makes there is the one that a desk makes of both drives' logs."""

from pathlib import Path
from typing import Any

from support.commissioned import PATH, Running, serve
from support.half_car_road import VAN
from support.known_load_logs import write_known_loads
from support.patience import wait_until

from gateway.calibration.calibrate import calibrate_inspected
from gateway.calibration.campaign import load_campaign
from gateway.calibration.file import load_calibration
from gateway.core.settings import BatchSettings
from gateway.offline.campaigns import inspect
from gateway.records import iso_utc

WINDOW_S = 100.0
TICKETS = "/api/v1/calibration/tickets"
VEHICLE = {
    "kerb_front_axle_kg": 725.0,
    "kerb_rear_axle_kg": 683.0,
    "wheelbase_m": VAN.wheelbase_m,
    "sensor_position_m": VAN.sensor_position_m,
    "empty_mass_kg": VAN.empty_mass_kg,
    "empty_front_share_pct": VAN.empty_front_share_pct,
    "empty_front_share_std_pct": VAN.empty_front_share_std_pct,
}
CONFIGURATION = """
signals = "springscale:reference"
[vehicle]
id = "van-17"
[bus]
interface = "virtual"
channel = "{channel}"
[batch]
window_s = {window_s}
provisional_every_s = 0.0
silence_s = 2.0
[web]
port = 0
[store]
directory = "state"
"""


def test_a_ticket_makes_the_calibration_that_a_desk_makes_of_both_drives(tmp_path: Path) -> None:
    config = tmp_path / "springscale.toml"
    config.write_text(CONFIGURATION.format(channel=tmp_path.name, window_s=WINDOW_S))
    campaign = load_campaign(
        write_known_loads(tmp_path, ((0.0, None), (300.0, 1.4)), 210.0, identification_fraction=1.0)
    )
    said: dict[str, Any] = {}

    def meet(running: Running) -> None:
        running.step("", {})
        running.step("line", {"line": None})
        running.step("vehicle", VEHICLE)
        running.step("empty", {"is_empty": True})
        running.play(tmp_path / "01.log")
        running.step("fit", {})
        said["base"] = running.wait_until(lambda told: told["active"] is not None)["active"]
        running.wait_until(lambda told: running.n_starts == 2 and not told["is_pending"])
        running.play(tmp_path / "02.log")
        running.now.store.flush(60.0)
        epoch = running.ask("/api/v1/estimates?order=newest_first&limit=1")["items"][0]
        weight = {"by": "payload", "payload_kg": 300.0, "position_m": 1.4, "at": iso_utc(epoch["t_end_ns"])}
        said["ticket"] = running.ask(TICKETS, {"weight": weight, "note": "no. 17"})
        running.wait_until(lambda told: running.n_starts == 3 and not told["is_pending"])
        assert wait_until(lambda: not running.ask(TICKETS)["is_busy"])
        said["tickets"] = running.ask(TICKETS)
        said["refitted"] = running.ask(PATH)["active"]

    serve(config, meet)

    assert said["ticket"].get("payload_kg") == 300.0, said["ticket"]
    settings = BatchSettings(window_s=WINDOW_S)
    desk = calibrate_inspected(campaign, inspect(campaign, settings), estimators=("cross_spectrum",)).file
    refitted = load_calibration(next((tmp_path / "state").glob(f"commissioned-{said['refitted']['id'][7:23]}.json")))
    assert refitted.id != said["base"]["id"]
    assert refitted.cross_spectrum is not None
    assert desk.cross_spectrum is not None
    assert refitted.cross_spectrum.model_dump_json() == desk.cross_spectrum.model_dump_json()
    assert (said["refitted"]["by"], said["refitted"]["note"]) == ("service", "with one ticket")
    assert (said["tickets"]["n_teaching"], said["tickets"]["fault"]) == (1, None)
    assert said["tickets"]["planned"]["then_payload_std_kg"] <= said["tickets"]["planned"]["payload_std_kg"]
