"""Writes docs/signal-map.md from gateway/bus/signals and gateway/units.py; with --check only compares it."""

from pathlib import Path
from typing import Final

from generated import keep_up_to_date, key_table

from gateway.bus.signals import SignalMapFile, shipped_map
from gateway.bus.signals.resolve import QUANTITIES
from gateway.bus.signals.signal_map import SignalEntry, shipped_maps
from gateway.records import Signal
from gateway.units import TO_SI

PAGE = Path(__file__).with_name("signal-map.md")

MEANINGS: Final = {
    Signal.VERTICAL_ACCELERATION: "needed; z up, about +9.81 m/s² at rest (gravity is removed later)",
    Signal.PITCH_RATE: "needed; about y, positive **nose down**",
    Signal.SPEED: "needed; over ground, from GNSS",
    Signal.ROLL_RATE: "about x, positive **left side up**; tells where the load lies sideways, never refuses a batch",
    Signal.LONGITUDINAL_ACCELERATION: "x forward; inspection names swapped axes with it",
    Signal.WHEEL_SPEED: "stands in for `speed` where that is missing",
    Signal.IGNITION: "of the journey; 1 while it is on",
    Signal.AMBIENT_TEMPERATURE: "decoded and counted, nothing uses it yet",
    Signal.AXLE_WEIGHT: "of the vehicle's own load sensors; shown beside, see below",
    Signal.LATITUDE: "of the journey; WGS 84, north positive",
    Signal.LONGITUDE: "of the journey; WGS 84, east positive",
    Signal.ODOMETER: "of the journey; only differences count, so a trip's counter will do",
    Signal.DOOR: "of the journey; above 0 while any door of the load room is open",
    Signal.AIR_SPRING_PRESSURE: "of the vehicle's own load sensors; shown beside, see below",
    Signal.RIDE_HEIGHT: "likewise; its zero is the sensor's own",
}
SI_UNITS: Final = {
    "acceleration": "m/s²", "angular_rate": "rad/s", "speed": "m/s", "angle": "°",
    "distance": "m", "pressure": "Pa", "mass": "kg", "temperature": "°C", "state": "none"
}  # fmt: skip

INTRODUCTION = """\
# The signal map

Generated from `gateway/bus/signals/signal_map.py` and `gateway/units.py` by `python docs/make_signal_map.py`; do not
edit by hand.

A signal map is a TOML file that says which message of a CAN database carries which of our signals. Everything the
database knows (bits, scale, unit, range, multiplexing) is taken from there. `springscale check-config` and every
command that reads a map name each fault with its file and key. Axes and signs: [nomenclature](nomenclature.md).

`springscale look LOG --output signals.toml` drafts one from a recorded drive: it lists who speaks and how often, says
which shipped maps fit, finds the axis that reads 9.8 m/s² and the one that braking shows, and says what is lacking. It
reads the databases beside the log, or those that `--dbc` names.

```toml
dbc = ["springscale_reference.dbc"]

[signals.vertical_acceleration]
message = "IMU_ACCEL"
signal = "AccelZ"
valid_when = { AccelValid = 1 }
counter = "AccelCounter"              # late frames are told from lost ones

[signals.pitch_rate]
message = "IMU_GYRO"
signal = "PitchRate"
sign = 1                              # -1 where the device counts nose up
valid_when = { GyroValid = 1 }

[signals.roll_rate]                   # optional; the same sensor nearly always sends it
message = "IMU_GYRO"
signal = "RollRate"
sign = 1                              # -1 where the device counts left side down
valid_when = { GyroValid = 1 }

[signals.speed]
message = "GPS_SPEED"
signal = "Speed"
latency_s = 0.2                       # the receiver tells the speed of 0.2 s ago
valid_when = { Fix = [2, 3] }         # a list: any of these
```
"""

NOTES = """\
## Details

**valid_when.** A sample counts where every named signal of the same message has one of the values given. A value is a
number in the database's units, or the name that the database gives to one (`valid_when = { Status = "ready" }`). A
signal that is coded as a float cannot be asked for: there equality means nothing.

**minimum, maximum.** Without them the range is the database's; where that says none, it is what the bits can carry. A
sample outside is missing, and counted.

**j1939.** With `j1939 = true` messages with 29-bit identifiers are found by their parameter group, whatever priority
and source address stand in the frame. The codes for "not available", "error" and "reserved" then never become numbers.
Frames with 11-bit identifiers are not affected.

```toml
dbc = ["j1939.dbc"]
j1939 = true

[signals.vertical_acceleration]
message = "ACCS"
signal = "VerticalAcceleration"

[signals.pitch_rate]
message = "ARI"
signal = "AngularRate1"

[signals.roll_rate]
message = "ARI"
signal = "AngularRate2"

[signals.speed]
message = "CCVS1"
signal = "WheelBasedVehicleSpeed"
```

**channel.** Only for log files that hold several buses: frames of other channels are left out. The live channel is the
one in `springscale.toml` ([settings](settings.md)).

**roll_rate.** Without it a sensor beside the centre line takes roll for heave, and nothing tells where a load lies
sideways. Where it fails (silent, stuck, saturated, too slow) a batch counts as if it were not mapped.

**Of the journey.** `latitude`, `longitude`, `odometer`, `ignition` and `door` say where the vehicle is, how far it
came, and when somebody may have been at the load. All are optional. They weigh nothing: with or without them every
batch is the same, bit for bit, and a frame that carries nothing else keeps no drive alive. Positions stay degrees, as
WGS 84 and VSS have them. They are not kept unless the settings ask for it ([settings](settings.md), `[position]`).

**Of the vehicle's own load sensors.** `axle_weight`, `air_spring_pressure` and `ride_height` are what a vehicle with
air springs or a load sensor says of itself, standing too. All are optional. The [cab page](cab.md) and
`GET /api/v1/status` show the last reading beside what Springscale weighs, under its own name; no batch reads it, and
no drive is kept alive by it. The J1939 maps read the rear left bellow's pressure (`ASC4`, PGN 65112, SPN 1727). An
axle's weight (`VW`, PGN 65258, SPN 582) is in their database and in no map: one group tells all axles in turn, so name
the one you mean by the number that your vehicle sends for it:

```toml
dbc = ["j1939.dbc"]
j1939 = true

[signals.vertical_acceleration]
message = "ACCS"
signal = "VerticalAcceleration"

[signals.pitch_rate]
message = "ARI"
signal = "AngularRate1"

[signals.speed]
message = "CCVS1"
signal = "WheelBasedVehicleSpeed"

[signals.axle_weight]
message = "VW"
signal = "AxleWeight"
valid_when = { AxleLocation = 1 }
```

**latency_s.** Samples are moved back by it, so that a late speed stands beside the motion it belongs to.

**counter.** Most sensors number their messages. Where stamps come late or in heaps (USB adapters, a busy computer), the
counter tells a late frame from a lost one, and the batch is timed by the sensor's own clock. Two bits at least; what
goes round within a heap, or is contradicted by the stamps, is passed over. Good stamps stay as they are.

**unit.** The database's unit counts. Where it says none or a wrong one, `unit` stands instead:

```toml
dbc = ["springscale_reference.dbc"]
channel = "can1"

[signals.vertical_acceleration]
message = "IMU_ACCEL"
signal = "AccelZ"
unit = "m/s^2"
minimum = -30.0                       # in SI
maximum = 30.0

[signals.pitch_rate]
message = "IMU_GYRO"
signal = "PitchRate"

[signals.speed]
message = "GPS_SPEED"
signal = "Speed"
```
"""


def signal_map_page() -> str:
    """The whole page as Markdown."""
    return "\n".join(
        [
            INTRODUCTION,
            f"## Top of the file\n\n{key_table(SignalMapFile, 'signals')}",
            f"## [signals.NAME]\n\n{key_table(SignalEntry)}",
            f"## Signals\n\n{_signals()}",
            f"## Units\n\nUpper or lower case is all the same.\n\n{_units()}",
            NOTES,
            f"## Maps that come with the package\n\n{_shipped()}",
        ]
    )


def _signals() -> str:
    rows = [
        f"| `{signal}` | {QUANTITIES[signal].replace('_', ' ')} | {meaning} |" for signal, meaning in MEANINGS.items()
    ]
    return "| NAME | quantity | meaning |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def _units() -> str:
    rows = [
        f"| {quantity.replace('_', ' ')} | {SI_UNITS[quantity]} | {', '.join(map(_unit, units))} |"
        for quantity, units in TO_SI.items()
    ]
    return "| quantity | becomes | accepted names |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def _unit(name: str) -> str:
    return f"`{name}`" if name else "none at all"


def _shipped() -> str:
    rows = [f"| `springscale:{name}` | {_first_line(shipped_map(name))} |" for name in shipped_maps()]
    head = (
        'Say `signals = "springscale:NAME"`, or copy one from `dbc/` and change it: each says which axes its device\n'
    )
    head += "has and where the signs of its rates come from.\n\n| map | device |\n|---|---|\n"
    return head + "\n".join(rows) + "\n"


def _first_line(path: Path) -> str:
    return path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ").split(". ")[0].rstrip(".")


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, signal_map_page(), "gateway/bus/signals")


if __name__ == "__main__":
    main()
