"""Our weights in the words of others: VSS, and our own figures behind it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.estimates import make_estimate, posterior_of
from support.paper_van import paper_van
from support.web import Client, Gateway

from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import weighed
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.estimates.quantities import QUANTITIES
from gateway.records import Why
from gateway.web.app import create_app
from gateway.weighing.calibrated import CalibratedVehicle

VIN = "VF1" + "0" * 14
VAN = paper_van(
    unsprung_front_kg=90.0,
    unsprung_rear_kg=110.0,
    gross_limit_kg=1545.0,
    front_axle_limit_kg=900.0,
    track_width_m=1.5,
    front_wheel_limit_kg=400.0,
)


@pytest.fixture
def gateway(tmp_path: Path) -> Any:
    with Gateway(tmp_path) as opened:
        opened.status = opened.status.model_copy(update={"vin": VIN})
        yield opened


def client(gateway: Gateway, vehicle: Vehicle | None = VAN) -> Client:
    calibrated = None if vehicle is None else CalibratedVehicle("sha256:ab", vehicle, (0.0, 420.0), (40.0, 60.0))
    return Client(create_app(gateway.board, gateway.store.reader(), lambda: gateway.status, calibrated=calibrated))


def loaded(n: int, payload_kg: float = 100.0) -> Estimate:
    return make_estimate(n).answered(posterior_of(payload_kg, 50.0, 6.0, 0.5))


def to_the_left(n: int) -> Estimate:
    """50 mm."""
    return replace(
        make_estimate(n).answered(posterior_of(100.0, 50.0, 6.0, 0.5, cg_left_m=0.05)),
        left_share=Quantity(53.3, 0.27),
        roll_share_front=0.6,
        roll_share_front_std=0.05,
    )


def test_weights_have_deviation_limit_and_warning(gateway: Gateway) -> None:
    gateway.publish(loaded(0))
    told = client(gateway).get("/api/v1/weights/latest").json()
    known = {"is_over_limit": False, "lacks": None, "is_unsprung_estimated": False}
    interval = {"interval95_kg": [1528.24022, 1551.75978]}
    assert told["gross"] == {"kg": 1540.0, "std_kg": 6.0, **interval, "limit_kg": 1545.0, **known}
    assert (told["front_axle"]["kg"], told["front_axle"]["std_kg"]) == pytest.approx((760.0, 7.341), abs=1e-3)
    assert told["front_axle"]["limit_kg"] == 900.0
    assert told["rear_axle"]["limit_kg"] is None
    assert (told["id"], told["age_s"]) == (loaded(0).id, 0.0)


def test_wheels_are_weighed_where_the_load_is_known_to_lie_sideways(gateway: Gateway) -> None:
    gateway.publish(loaded(0))
    told = client(gateway).get("/api/v1/weights/latest").json()
    unknown = {
        "kg": None,
        "std_kg": None,
        "interval95_kg": None,
        "limit_kg": 400.0,
        "is_over_limit": False,
        "lacks": "roll_rate",
    }
    unknown["is_unsprung_estimated"] = False
    assert told["front_left"] == unknown
    assert (told["load"]["left_m"], told["load"]["left_std_m"]) == (None, None)
    gateway.publish(to_the_left(1))
    told = client(gateway).get("/api/v1/weights/latest").json()
    wheels = [told[wheel]["kg"] for wheel in ("front_left", "front_right", "rear_left", "rear_right")]
    expected = [406.8, 353.2, 407.867, 372.133]  # of 1340 kg sprung, 50 mm to the left on 1.5 m: 44.667 kg
    assert wheels == pytest.approx(expected, abs=1e-3)
    assert (told["front_left"]["is_over_limit"], told["front_right"]["is_over_limit"]) == (True, False)
    assert (told["load"]["left_m"], told["load"]["left_std_m"]) == (0.67, 0.065)


def test_every_record_brings_its_weights_to_the_history(gateway: Gateway) -> None:
    gateway.publish(weighed(to_the_left(0), VAN), make_estimate(1, Why.GAP))
    answer, refusal = client(gateway).get("/api/v1/estimates").json()["items"]
    assert answer["weights"]["front_left"] == {
        "kg": 406.8,
        "std_kg": 4.840601,  # of 1.62, 3.35, 2.144 and 2.233 kg by payload, share, place and the axles' part
        "limit_kg": 400.0,
        "interval95_kg": [397.312597, 416.287403],
        "is_over_limit": True,
        "lacks": None,
        "is_unsprung_estimated": False,
    }
    assert refusal["weights"]["gross"]["lacks"] == "calibration"
    assert (answer["cg_left_m"], answer["left_share_pct"]) == (0.05, 53.3333333)


@pytest.mark.parametrize("vehicle", [None, replace(VAN, unsprung_front_kg=None)])
def test_unknown_weights_are_null(gateway: Gateway, vehicle: Vehicle | None) -> None:
    gateway.publish(loaded(0))
    told = client(gateway, vehicle).get("/api/v1/weights/latest").json()
    assert told["gross"]["kg"] is told["front_axle"]["kg"] is None
    assert (told["rear_axle"]["kg"] is None) is (vehicle is None)


def test_vss_has_core_paths_and_every_quantity_with_its_unit(gateway: Gateway) -> None:
    gateway.publish(to_the_left(0))
    told = client(gateway).get("/api/v1/vss").json()
    points = {point["path"]: point for point in told}
    assert len(points) == len(told)
    core = ("Vehicle.CurrentOverallWeight", "Vehicle.CurbWeight", "Vehicle.GrossWeight")
    assert {one.vss: one.vss_unit for one in QUANTITIES}.items() <= {p: o["unit"] for p, o in points.items()}.items()
    assert all(isinstance(point["value"], float) for path, point in points.items() if path not in core)
    assert {path: points[path]["value"] for path in core} == {
        "Vehicle.CurrentOverallWeight": 1540,
        "Vehicle.CurbWeight": 1440,
        "Vehicle.GrossWeight": 1545,
    }
    assert points["Vehicle.Chassis.Axle.Row1.Load"]["value"] == 760.0
