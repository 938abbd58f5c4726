"""Verifying a real service: drives on the bus, known loads over the command line, the record after a restart."""

import json
from pathlib import Path

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.ports import first_answer
from support.running_service import Running, configuration, events, serve, stored

from gateway.bus.logs import write_candump
from gateway.records import iso_utc

HOUR_NS = 3_600 * 10**9
DUE = """
[verification]
permitted_error_pct = 0.5
every_days = 365.0
"""


@pytest.fixture
def logs(tmp_path: Path) -> list[Path]:
    """Two drives, an hour from one to the next."""
    paths = [tmp_path / f"drive{n}.log" for n in range(2)]
    for n, path in enumerate(paths):
        write_candump(white_noise(45.0, START_NS + n * HOUR_NS, seed=n), "can0", path)
    return paths


def test_known_loads_are_judged_kept_and_change_no_number(tmp_path: Path, logs: list[Path]) -> None:
    config = configuration(tmp_path, calibration_file(payload_kg=12.0, front_share_pct=51.0).to_json(), DUE)
    made = {}
    between = iso_utc(START_NS + HOUR_NS // 2)

    def first_run(service: Running) -> None:
        service.play(logs[0])
        assert any(
            "verification" in one for one in first_answer(f"{service.gateway.url}/api/v1/status").json()["warnings"]
        )
        made.update(service.told("verification", "record", "--load", f"payload_kg=0,at={between}", "--note", "empty"))
        service.play(logs[1])
        assert "ambiguous_epoch" in str(
            service.ask("verification", "record", "--load", f"payload_kg=0,at={between}").exception
        )

    def second_run(service: Running) -> None:
        assert service.told("verification", "show")["history"] == [made]
        failed = service.told("verification", "record", "--load", f"payload_kg=0,at={between},drive=after")
        assert failed["loads"][0]["t_start"][:19] == iso_utc(START_NS + HOUR_NS)[:19]
        passed = service.told("verification", "record", "--load", f"payload_kg=10,at={between},drive=after")
        assert (failed["verdict"], passed["verdict"]) == ("failed", "passed")
        told = first_answer(f"{service.gateway.url}/api/v1/status").json()
        assert told["verification"]["is_due"] is False
        assert "springscale_verification_due 0.0" in first_answer(f"{service.gateway.url}/metrics").text

    serve(config, first_run)
    before = stored(config)
    serve(config, second_run)
    assert (made["verdict"], made["loads"][0]["error_kg"], made["note"]) == ("failed", 12.0, "empty")
    assert stored(config) == before
    assert json.loads(before[0])["payload_kg"] == 12.0
    assert [kind for kind in events(config) if kind == "verified"] == ["verified"] * 3
