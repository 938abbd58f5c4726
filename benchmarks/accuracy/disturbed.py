"""What may go wrong with a calibrated vehicle, its sensors, stamps and loads: each disturbance by name.

Some disturb the rows of a drive that was recorded well. The others drive again: with sensors that sit elsewhere or are
others, with a vehicle that has worn, or with a load of a kind that calibration never saw.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.records import F64, I64, Motion, Signal, Why
from gateway.sim.instruments import Sensors
from gateway.sim.parameters import Axle, Damper, Load, Vehicle
from gateway.units import NS_PER_S

WORN_BY: Final = 0.35  # chosen: of the dampers' rates
MORE_FRICTION: Final = 2.5  # chosen: times the dampers' friction
SOFTER_TYRES_BY: Final = 0.15  # chosen: of the tyres' rate
ON_TOW_BAR_KG: Final = 60.0  # chosen: a full bicycle carrier
TOW_BAR_BEHIND_AXLE_M: Final = 0.9  # as core.cargo has it
PARCELS_M: Final = (1.2, 2.4)  # chosen: high, long

Rows = Callable[[Motion, np.random.Generator], Motion]
Loads = tuple[Load, ...]
World = Callable[[Vehicle, Loads], tuple[Vehicle, Loads]]


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One line of the table. ``rows`` disturbs what was decoded; other ``sensors``, or another ``world`` of vehicle and
    loads, drive again.

    ``is_mended``: errors should stay within 1.25 times the undisturbed ones; ``reasons`` are the right reasons to
    refuse.
    """

    name: str
    rows: Rows = lambda motion, rng: motion
    sensors: Callable[[Sensors], Sensors] = lambda sensors: sensors
    world: World = lambda van, loads: (van, loads)
    is_overloaded: bool = False
    is_sideways: bool = False
    has_roll_rate: bool = True
    is_mended: bool = False
    reasons: tuple[Why, ...] = ()


def _stamped(stamp: Callable[[I64, np.random.Generator], I64]) -> Rows:
    """Rows with other stamps, in their new order."""

    def disturb(motion: Motion, rng: np.random.Generator) -> Motion:
        t_ns = stamp(motion.t_ns, rng)
        order = np.argsort(t_ns, kind="stable")
        return Motion(motion.signals, t_ns[order], motion.columns[order])

    return disturb


def jittered(mean_s: float) -> Rows:
    """Every stamp delayed exponentially, but never before an earlier one."""
    return _stamped(
        lambda t_ns, rng: np.maximum.accumulate(
            t_ns + np.rint(rng.exponential(mean_s, len(t_ns)) * NS_PER_S).astype(int)
        )
    )


def heaped(every_s: float) -> Rows:
    """Frames delivered together at intervals and stamped then, as USB adapters do."""
    every_ns = round(every_s * NS_PER_S)
    return _stamped(lambda t_ns, rng: t_ns[0] - (t_ns[0] - t_ns) // every_ns * every_ns)


def stalled(length_s: float, every_s: float) -> Rows:
    """A reader that stalls for a moment at intervals."""
    length_ns, every_ns = round(length_s * NS_PER_S), round(every_s * NS_PER_S)

    def stamp(t_ns: I64, rng: np.random.Generator) -> I64:
        into_ns = (t_ns - t_ns[0]) % every_ns
        return np.where(into_ns < length_ns, t_ns - into_ns + length_ns, t_ns)

    return _stamped(stamp)


def lossy(share: float) -> Rows:
    """Frames lost by chance."""

    def disturb(motion: Motion, rng: np.random.Generator) -> Motion:
        kept = rng.random(len(motion)) >= share
        return Motion(motion.signals, motion.t_ns[kept], motion.columns[kept])

    return disturb


def lagging(by_s: float) -> Rows:
    """The gyro's frames come later than the accelerometer's."""

    def disturb(motion: Motion, rng: np.random.Generator) -> Motion:
        is_gyro = np.isfinite(motion.columns[:, motion.signals.index(Signal.PITCH_RATE)])
        return _stamped(lambda t_ns, rng: np.where(is_gyro, t_ns + round(by_s * NS_PER_S), t_ns))(motion, rng)

    return disturb


def amplified(by: float, *of: Signal) -> Rows:
    """Sensors with changed gains; that of the accelerometer changes gravity too."""

    def disturb(motion: Motion, rng: np.random.Generator) -> Motion:
        columns = motion.columns.copy()
        columns[:, [motion.signals.index(signal) for signal in of]] *= 1.0 + by
        return replace(motion, columns=columns)

    return disturb


def drawing_a_trailer(motion: Motion, rng: np.random.Generator) -> Motion:
    """Every frame reports a trailer; nothing else changes."""
    drawn = np.ones((len(motion), 1))
    return replace(motion, signals=(*motion.signals, Signal.TRAILER), columns=np.hstack([motion.columns, drawn]))


def half_of_the_time(signal: Signal, to: Callable[[F64], F64]) -> Rows:
    """One signal replaced by ``to`` of its samples in every second minute."""

    def disturb(motion: Motion, rng: np.random.Generator) -> Motion:
        columns = motion.columns.copy()
        column = columns[:, motion.signals.index(signal)]
        minute = (motion.t_ns - motion.t_ns[0]) // (60 * NS_PER_S)
        touched = np.isfinite(column) & (minute % 2 == 1)
        for each in np.unique(minute[touched]):
            now = touched & (minute == each)
            column[now] = to(column[now])
        return replace(motion, columns=columns)

    return disturb


def stuck(samples: F64) -> F64:
    """All samples equal to the first."""
    return np.full_like(samples, samples[0])


def missing(samples: F64) -> F64:
    """NaN in place of every sample."""
    return np.full_like(samples, np.nan)


def _moved(back_m: float = 0.0, left_m: float = 0.0, yaw_deg: float = 0.0) -> Callable[[Sensors], Sensors]:
    def moved(sensors: Sensors) -> Sensors:
        mount = sensors.mount
        return replace(
            sensors,
            mount=replace(
                mount,
                position_m=mount.position_m + back_m,
                left_m=mount.left_m + left_m,
                yaw_deg=mount.yaw_deg + yaw_deg,
            ),
        )

    return moved


def noisier(accel: float = 1.0, gyro: float = 1.0) -> Callable[[Sensors], Sensors]:
    """White noise with its density multiplied."""

    def noisy(sensors: Sensors) -> Sensors:
        imu = sensors.imu
        louder = [
            replace(one, noise_density=by * one.noise_density) for one, by in ((imu.accel, accel), (imu.gyro, gyro))
        ]
        return replace(sensors, imu=replace(imu, accel=louder[0], gyro=louder[1]))

    return noisy


def _sampled_at(rate_hz: float) -> Callable[[Sensors], Sensors]:
    return lambda sensors: replace(sensors, imu=replace(sensors.imu, rate_hz=rate_hz))


def _with_axles(axle: Callable[[Axle], Axle]) -> World:
    return lambda van, loads: (replace(van, front=axle(van.front), rear=axle(van.rear)), loads)


def _with_dampers(damper: Callable[[Damper], Damper]) -> World:
    return _with_axles(lambda axle: replace(axle, damper=damper(axle.damper)))


def _worn(damper: Damper) -> Damper:
    left = 1.0 - WORN_BY
    return replace(damper, compression_nspm=left * damper.compression_nspm, rebound_nspm=left * damper.rebound_nspm)


def _with_more_friction(damper: Damper) -> Damper:
    return replace(damper, friction_n=MORE_FRICTION * damper.friction_n)


def _with_softer_tyres(axle: Axle) -> Axle:
    return replace(axle, wheel=replace(axle.wheel, tyre_npm=(1.0 - SOFTER_TYRES_BY) * axle.wheel.tyre_npm))


def _on_tow_bar(**base: float) -> World:
    """A mass on the tow bar in addition to the load; ``base`` are its resonance and damping as a Load has them."""

    def carrying(van: Vehicle, loads: Loads) -> tuple[Vehicle, Loads]:
        behind_m = van.wheelbase_m + TOW_BAR_BEHIND_AXLE_M
        ball = Load(ON_TOW_BAR_KG, behind_m, height_m=0.45, length_m=0.1, width_m=0.1, tall_m=0.1, **base)
        return van, (*loads, ball)

    return carrying


def _long_and_high(van: Vehicle, loads: Loads) -> tuple[Vehicle, Loads]:
    """The same loads as parcels: their floor stays where it is."""
    tall_m, length_m = PARCELS_M
    return van, tuple(
        replace(load, height_m=load.height_m + 0.5 * (tall_m - load.tall_m), tall_m=tall_m, length_m=length_m)
        for load in loads
    )


_SENSOR_MOVED: Final = (Why.SENSOR_CHANGED, Why.MODEL_MISFIT)
_UNSEEN: Final = (Why.TOO_UNCERTAIN, Why.MODEL_MISFIT)  # a half-car has no roll, and a wide enough interval is useless
_BEYOND: Final = (Why.OUT_OF_RANGE, Why.MODEL_MISFIT, Why.TOO_UNCERTAIN)

UNDISTURBED: Final = Disturbance("as recorded", is_mended=True)
DISTURBANCES: Final[Mapping[str, Disturbance]] = MappingProxyType(
    {
        one.name: one
        for one in (
            UNDISTURBED,
            Disturbance("jitter of 1 ms", jittered(0.001), is_mended=True, reasons=(Why.TIME_STAMPS,)),
            Disturbance("jitter of 3 ms", jittered(0.003), is_mended=True, reasons=(Why.TIME_STAMPS,)),
            Disturbance("heaps every 16 ms", heaped(0.016), is_mended=True, reasons=(Why.TIME_STAMPS,)),
            Disturbance("heaps every 40 ms", heaped(0.040), is_mended=True, reasons=(Why.TIME_STAMPS,)),
            Disturbance("stalls of 40 ms every 2 s", stalled(0.04, 2.0), is_mended=True, reasons=(Why.TIME_STAMPS,)),
            Disturbance("2 % of frames lost", lossy(0.02), is_mended=True, reasons=(Why.GAP, Why.TIME_STAMPS)),
            Disturbance("10 % of frames lost", lossy(0.1), is_mended=True, reasons=(Why.GAP, Why.TIME_STAMPS)),
            Disturbance("gyro late by 5 ms", lagging(0.005), is_mended=True),
            Disturbance("gyro late by 20 ms", lagging(0.020), is_mended=True),
            Disturbance(
                "accelerometer's gain + 2 %", amplified(0.02, Signal.VERTICAL_ACCELERATION), reasons=_SENSOR_MOVED
            ),
            Disturbance(
                "accelerometer's gain + 5 %", amplified(0.05, Signal.VERTICAL_ACCELERATION), reasons=_SENSOR_MOVED
            ),
            Disturbance(
                "gyro's gain + 3 %", amplified(0.03, Signal.PITCH_RATE, Signal.ROLL_RATE), reasons=_SENSOR_MOVED
            ),
            Disturbance("sensor moved 0.2 m left", sensors=_moved(left_m=0.2), reasons=_SENSOR_MOVED),
            Disturbance("sensor moved 0.2 m back", sensors=_moved(back_m=0.2), reasons=_SENSOR_MOVED),
            Disturbance("sensor turned by 10 degrees", sensors=_moved(yaw_deg=10.0), reasons=_SENSOR_MOVED),
            Disturbance("a trailer is drawn", drawing_a_trailer, reasons=(Why.TRAILER,)),
            Disturbance("sensor noise x 5", sensors=noisier(5.0, 5.0), reasons=(Why.SENSOR_NOISY,)),
            Disturbance("sampled at 50 Hz", sensors=_sampled_at(50.0), reasons=(Why.SAMPLE_RATE,)),
            Disturbance("no roll rate", has_roll_rate=False),
            Disturbance("load sideways", is_sideways=True),
            Disturbance("load sideways, no roll rate", is_sideways=True, has_roll_rate=False, reasons=_UNSEEN),
            Disturbance(
                "load sideways, roll rate stuck half the time",
                half_of_the_time(Signal.ROLL_RATE, stuck),
                is_sideways=True,
                reasons=_UNSEEN,
            ),
            Disturbance(
                "load sideways, roll rate missing half the time",
                half_of_the_time(Signal.ROLL_RATE, missing),
                is_sideways=True,
                reasons=_UNSEEN,
            ),
            Disturbance("dampers - 35 %", world=_with_dampers(_worn), reasons=(Why.MODEL_MISFIT,)),
            Disturbance("friction x 2.5", world=_with_dampers(_with_more_friction), reasons=(Why.MODEL_MISFIT,)),
            Disturbance("tyres - 15 %", world=_with_axles(_with_softer_tyres), reasons=(Why.MODEL_MISFIT,)),
            Disturbance("load 2.4 m long and 1.2 m high", world=_long_and_high),
            Disturbance("60 kg more on a tow bar", world=_on_tow_bar(), reasons=_BEYOND),
            Disturbance(
                "60 kg more on a soft tow bar",
                world=_on_tow_bar(resonance_hz=3.0, damping_ratio=0.1),
                reasons=_BEYOND,
            ),
            Disturbance("load beyond the calibrated", is_overloaded=True, reasons=_BEYOND),
        )
    }
)
