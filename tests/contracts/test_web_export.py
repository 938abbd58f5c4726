"""The history as a file: every batch once, whatever its length, readable by the standard tools."""

import csv
import io
from pathlib import Path

from support.estimates import make_estimate, make_record
from support.paper_van import paper_van
from support.web import Client, Gateway

from gateway.core.ratio_index.index import Band, RatioIndexCalibration
from gateway.estimates.as_json import COLUMNS
from gateway.records import Why
from gateway.status import SignalHealth
from gateway.weighing.calibrated import CalibratedVehicle

N_ROWS = 1203  # several pages of the store, the last one not full


def test_every_batch_is_in_the_csv_once(gateway: Gateway) -> None:
    gateway.publish(*(make_estimate(n, *([Why.GAP, Why.TOO_SLOW] if n % 4 == 0 else [])) for n in range(N_ROWS)))
    answer = Client(gateway.app).get("/api/v1/export.csv")
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert answer.headers["content-disposition"] == 'attachment; filename="springscale.csv"'
    rows = list(csv.DictReader(io.StringIO(answer.text, newline="")))
    assert [int(row["t_end_ns"]) for row in rows] == [make_record(n)["t_end_ns"] for n in range(N_ROWS)]
    assert list(rows[0]) == list(COLUMNS)
    assert rows[0]["payload_kg"] == rows[0]["payload_low95_kg"] == ""  # unknown is empty, never 0
    assert rows[0]["rejected"] == "gap too_slow"
    assert [float(rows[1][c]) for c in ("payload_kg", "payload_low95_kg", "payload_high95_kg")] == [101, 89, 113]


def test_since_and_until_limit_the_export(gateway: Gateway) -> None:
    gateway.publish(*(make_estimate(n) for n in range(4)))
    query = "?since=1970-01-01T00:10:00Z&until=1970-01-01T00:20:00Z"
    rows = csv.DictReader(io.StringIO(Client(gateway.app).get(f"/api/v1/export.csv{query}").text, newline=""))
    assert [int(row["t_end_ns"]) for row in rows] == [make_record(n)["t_end_ns"] for n in (1, 2)]
    empty = Client(gateway.app).get("/api/v1/export.csv?since=2026-01-01T00:00:00Z").text
    assert empty == ",".join(COLUMNS) + "\r\n"


CALIBRATED = CalibratedVehicle(
    id="sha256:ab",
    vehicle=paper_van(gross_limit_kg=1900.0),
    payload_seen_kg=(0.0, 420.0),
    front_share_seen_pct=(42.0, 55.0),
    ratio_index=RatioIndexCalibration(
        "amplitude", 512, (Band(2.4, 0.05), Band(3.25, 0.05)), None, None, None, (13.0, 15.0), 3.0
    ),
)


def test_the_vehicle_is_shown_with_its_calibration_and_ranges(tmp_path: Path) -> None:
    health = SignalHealth(signal="speed", rate_hz=5.0)
    with Gateway(tmp_path, calibrated=CALIBRATED) as gateway:
        gateway.status = gateway.status.model_copy(
            update={"vin": "VF1" + "0" * 14, "estimator": "ratio_index", "signals": (health,)}
        )
        told = Client(gateway.app).get("/api/v1/vehicle").json()
    assert (told["vehicle_id"], told["vin"]) == ("van-17", "VF1" + "0" * 14)
    assert told["calibration"] == {
        "id": "sha256:ab",
        "estimators": ["ratio_index"],
        "payload_seen_kg": [0.0, 420.0],
        "front_share_seen_pct": [42.0, 55.0],
        "payload_believed_kg": [-105.0, 525.0],
        "front_share_believed_pct": [38.75, 58.25],
        "speed_seen_mps": [13.0, 15.0],
    }
    assert told["figures"]["sensor_position_m"] == 0.0
    assert told["figures"]["empty_mass_kg"] == 1240.0
    assert told["figures"]["rear_axle_limit_kg"] is None
    assert told["signals"][0]["rate_hz"] == 5.0


def test_a_missing_calibration_is_reported(gateway: Gateway) -> None:
    told = Client(gateway.app).get("/api/v1/vehicle").json()
    assert told["calibration"] is None
    assert told["figures"] is None
