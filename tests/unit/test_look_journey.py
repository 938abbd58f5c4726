"""Positions and odometers are found by name and unit, and by what they read; a map of them is drafted."""

import numpy as np
import pytest

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.signals.database import DatabaseSignal
from gateway.offline.look.look import journey_of
from gateway.offline.look.readings import SignalReading
from gateway.records import Signal


class Heard:
    rate_hz = 1.0


class Described:
    heard = Heard()


def reading(name: str, quantity: str, x: list[float], scale: float = 1.0) -> SignalReading:
    field = BitField(0, 32, coding=Coding.SIGNED, scale=scale)
    signal = DatabaseSignal(name, field, "deg", None, None, {}, None, ())
    return SignalReading(Described(), signal, quantity, np.arange(len(x), dtype=float), np.array(x))


@pytest.mark.parametrize(
    ("name", "quantity", "x", "role"),
    [
        ("Latitude", "angle", [47.1, 47.2], Signal.LATITUDE),
        ("GPS_Lat", "angle", [47.1, 47.2], Signal.LATITUDE),
        ("PosLongitude", "angle", [-122.0, -122.1], Signal.LONGITUDE),
        ("TotalVehicleDistance", "distance", [1000.0, 1000.0, 1125.0], Signal.ODOMETER),
        ("Odometer", "distance", [5.0, 6.0], Signal.ODOMETER),
        ("Latitude", "angle", [0.0, 0.0], None),  # no fix
        ("Latitude", "angle", [95.0, 47.0], None),
        ("LatitudeStdDev", "angle", [1.0, 2.0], None),
        ("Heading", "angle", [10.0, 20.0], None),
        ("Odometer", "distance", [6.0, 5.0], None),
        ("PositionAccuracy", "distance", [6.0, 7.0], None),
    ],
)
def test_name_unit_and_readings_together_tell_the_role(name, quantity, x, role):
    found = journey_of([reading(name, quantity, x)])
    assert [each.role for each in found] == ([] if role is None else [role])


def test_the_finest_of_several_is_taken():
    coarse, fine = reading("TotalDistance", "distance", [1.0, 2.0], 1000.0), reading("TripDistance", "distance", [1, 2])
    assert [each.reading for each in journey_of([coarse, fine])] == [fine]
