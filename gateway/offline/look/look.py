"""One look at a log: who speaks, what it may be, what carries gravity, and whether that can work."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from gateway.bus.heard import Heard
from gateway.bus.logs import LogReport
from gateway.bus.signals import shipped_databases
from gateway.core.batch import RATE_MIN_SHARE
from gateway.core.settings import BatchSettings
from gateway.errors import SignalMapError
from gateway.offline.look.fits import Fit, fits_of
from gateway.offline.look.heard import heard_in
from gateway.offline.look.journey import journey_of
from gateway.offline.look.readings import Described, Reading, databases_of, described, readings_of
from gateway.offline.look.roles import Found, roles_of, tilt_deg
from gateway.records import Signal

LEAST_RATE_HZ = RATE_MIN_SHARE * BatchSettings().rate_hz
MOST_TILT_DEG = 15.0  # 3 % of gravity; what lies along and across then mixes in as well


@dataclass(frozen=True, slots=True)
class Look:
    """What a log holds. ``lacking`` says what stands in the way; empty where this can work."""

    log: Path
    report: LogReport
    duration_s: float
    heard: tuple[Heard, ...]
    described: tuple[Described, ...]
    fits: tuple[Fit, ...]
    readings: tuple[Reading, ...]
    found: tuple[Found, ...]
    tilt_deg: float
    lacking: tuple[str, ...]
    faults: tuple[str, ...]

    @property
    def accelerations(self) -> tuple[Reading, ...]:
        """Every acceleration of which there is a sample."""
        return tuple(r for r in self.readings if r.quantity == "acceleration" and len(r.x))

    @property
    def unsure_databases(self) -> tuple[str, ...]:
        """Shipped databases that what was found is read by, where no shipped map fits as it is."""
        if any(fit.is_whole for fit in self.fits):
            return ()
        sources = dict.fromkeys(found.reading.described.message.source for found in self.found)
        return tuple(path.name for path in sources if path in shipped_databases())

    @property
    def shipped(self) -> Fit | None:
        """The one shipped map that fits as it is; None where none does, or several do."""
        whole = [fit for fit in self.fits if fit.is_whole]
        return whole[0] if len(whole) == 1 else None


def look(log: Path, databases: Sequence[Path] = ()) -> Look:
    """Look at a log with these databases (none: those beside it or one folder above) and those of the package.

    Raises LogUnreadableError where there is no frame in it, SignalMapError for a given database that cannot be read.
    """
    heard, report = heard_in(log)
    own, faults = databases_of(databases or _near(log))
    if databases and faults:
        raise SignalMapError(faults[0])
    shipped, _ = databases_of(shipped_databases())
    by_own = described(heard, own)
    others = [one for one in heard if not any(one is each.heard for each in by_own)]
    messages = (*by_own, *described(others, shipped))
    origin_ns = min(int(one.frames.t_ns.min()) for one in heard)
    readings = tuple(reading for one in messages for reading in readings_of(one, origin_ns))
    chosen = [r for r in readings if r.described in by_own] or readings
    found = (*roles_of(chosen), *journey_of(chosen))
    up = next((each for each in found if each.role is Signal.VERTICAL_ACCELERATION), None)
    tilt = tilt_deg(readings, up) if up else float("nan")
    fits = fits_of(heard)
    return Look(
        log, report, max(one.duration_s for one in heard), heard, messages, fits, readings, found, tilt,
        tuple(_lacking(found, fits, readings, tilt)), faults,
    )  # fmt: skip


def _near(log: Path) -> list[Path]:
    """Databases beside a log, or where there are none, one folder above: campaigns have a folder a drive."""
    folder = log.resolve().parent
    places = [(place, kinds) for kinds in (("dbc",), ("kcd", "arxml", "sym")) for place in (folder, folder.parent)]
    each = (sorted(path for kind in kinds for path in place.glob(f"*.{kind}")) for place, kinds in places)
    return next((found for found in each if found), [])


def _lacking(found: Sequence[Found], fits: Sequence[Fit], readings: Sequence[Reading], tilt: float) -> Iterator[str]:
    """What keeps a vehicle from being weighed by this, and how to mend it."""
    if any(fit.is_whole for fit in fits):
        whole = next(fit for fit in fits if fit.is_whole)
        if not {Signal.SPEED, Signal.WHEEL_SPEED} & set(whole.found):
            yield "no speed: add [signals.speed] from a GNSS receiver or the vehicle"
        return
    roles = {each.role: each for each in found}
    up = roles.get(Signal.VERTICAL_ACCELERATION)
    if not readings:
        yield "no database describes an acceleration in it: give the DBC of the sensor with --dbc"
        return
    if up is None:
        yield "no acceleration reads 9.8 m/s2: the sensor is not in this log, or takes gravity off"
    elif tilt > MOST_TILT_DEG:
        yield f"the sensor leans by {tilt:.0f} degrees: mount it level, or have it turn its axes"
    if up is not None and Signal.PITCH_RATE not in roles:
        yield "no pitch rate could be told: drive with some braking, or name it yourself"
    if not {Signal.SPEED, Signal.WHEEL_SPEED} & roles.keys():
        yield "no speed: add [signals.speed] from a GNSS receiver or the vehicle"
    for each in (up, roles.get(Signal.PITCH_RATE)):
        if each is not None and each.reading.rate_hz < LEAST_RATE_HZ:
            yield f"{each.reading.name} comes {each.reading.rate_hz:.0f} times a second; {LEAST_RATE_HZ:.0f} are needed"
