"""A simulated drive as decoded rows, what a wrong signal map would make of them, and the verdict on it."""

from dataclasses import replace

import numpy as np

from gateway.bus.signals import Decoder, SignalMap, load_signal_map
from gateway.calibration.inspection.facts import InspectedRun, row_facts
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch import Traits
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.records import Motion, Signal
from gateway.sim.instruments import REFERENCE
from gateway.sim.parameters import Load
from gateway.sim.parameters import Vehicle as SimulatedVehicle
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import Drive
from gateway.workbench.wiring import Wiring

ACCELERATION, PITCH_RATE, ROLL_RATE = Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE


def reference_map() -> SignalMap:
    return load_signal_map("springscale:reference")


def driven(
    van: SimulatedVehicle,
    drive: Drive,
    position_m: float,
    load: Load | None = None,
    gyro_axis: int = 1,
    rolls_about: int = 0,
    left_m: float = REFERENCE.mount.left_m,
    seed: int = 3,
) -> Motion:
    """The van over an ordinary road, its sensors this far behind the front axle and left of the centre line.

    gyro_axis and rolls_about say which axes pass for pitch and roll rate: 0 is roll, 1 pitch, 2 yaw.
    """
    sensors = replace(REFERENCE, mount=replace(REFERENCE.mount, position_m=position_m, left_m=left_m))
    loads = (load,) if load else ()
    recording = simulate_drive(van, loads, iso_road("B"), drive, sensors, seed).recording
    gyro = recording.gyro_radps.copy()
    gyro[:, [0, 1]] = gyro[:, [rolls_about, gyro_axis]]
    return Decoder(reference_map()).decode(Wiring("reference").frames_of(replace(recording, gyro_radps=gyro)))


def stated(van: SimulatedVehicle, position_m: float) -> Vehicle:
    """The van as a campaign file states it."""
    return Vehicle(
        name=van.name,
        empty_mass_kg=van.sprung_kg,
        wheelbase_m=van.wheelbase_m,
        empty_front_share_pct=van.empty_front_share_pct,
        sensor_position_m=position_m,
    )


def scaled(motion: Motion, **factors: float) -> Motion:
    """The recording as if the map gave these signals in other units or with other signs: pitch_rate=-1.0."""
    columns = motion.columns.copy()
    for name, factor in factors.items():
        columns[:, motion.signals.index(Signal(name))] *= factor
    return replace(motion, columns=columns)


def exchanged(motion: Motion, one: Signal, other: Signal, factor: float = 1.0) -> Motion:
    """The recording as if the map had exchanged two signals; the second is multiplied by ``factor``."""
    i, j = motion.signals.index(one), motion.signals.index(other)
    columns = motion.columns.copy()
    columns[:, [i, j]] = columns[:, [j, i]]
    columns[:, j] *= factor
    return replace(motion, columns=columns)


def without(motion: Motion, signal: Signal) -> Motion:
    """The recording as if the signal had never been valid."""
    return scaled(motion, **{signal: np.nan})


def traits_of_reference() -> Traits:
    """Latency and resolution of the reference map; its ranges are left aside, for a wrong unit scales them too."""
    traits = reference_map().traits
    return {signal: replace(trait, minimum=np.nan, maximum=np.nan) for signal, trait in traits.items()}


def with_resolution(traits: Traits, signal: Signal, resolution: float) -> Traits:
    """The recording with one signal in steps of ``resolution`` (SI)."""
    return {**traits, signal: replace(traits[signal], resolution=resolution)}


def verdict_on(
    motion: Motion,
    vehicle: Vehicle,
    traits: Traits,
    load: tuple[float, float | None] = (0.0, None),
    window_s: float = 120.0,
) -> InspectedRun:
    """All of the drive identifies; ``load`` is payload and its position."""
    settings = BatchSettings(window_s=window_s)
    scheduler = Scheduler(settings, traits)
    batches = (*scheduler.feed(motion), *scheduler.flush())
    run = known_drive(1, "a.log", load[0], front_share_pct(vehicle, *load), batches)
    read = InspectedRun(run, facts=row_facts(motion, traits))
    return replace(read, findings=inspect_run(read, vehicle, settings))


def kinds(verdict: InspectedRun) -> list[str]:
    """fault:pitch_rate_sign and so on."""
    return [f"{finding.severity}:{finding.kind}" for finding in verdict.findings]
