"""The setup that turns frames into estimates: signal map, calibration and estimator, all checked."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from gateway.bus.signals import SignalMap, load_signal_map
from gateway.calibration.file import CalibrationFile, load_calibration
from gateway.config import Settings
from gateway.core.batch_settings import BatchSettings
from gateway.core.weights.limits import Limits
from gateway.errors import ConfigurationError
from gateway.files.toml_file import Read
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.flow import Flow, Identity

NO_OTHER = Limits()  # than the calibration's
NOBODY = Identity()  # a log without a configuration belongs to no named vehicle


@dataclass(frozen=True, slots=True)
class Subject:
    """The vehicle that a service weighs, its calibration and the estimator in use."""

    calibrated: CalibratedVehicle | None
    estimator: str
    vehicle_id: str | None

    @property
    def calibration_id(self) -> str | None:
        """Identifier of the calibration in use; None without one."""
        return None if self.calibrated is None else self.calibrated.id


@dataclass(frozen=True, slots=True)
class Setup:
    """The parts that turn frames into estimates, loaded and checked.

    ``limits`` override those of the calibration.
    """

    signal_map: SignalMap
    calibration: CalibrationFile | None
    estimator: str
    identity: Identity
    limits: Limits = NO_OTHER
    calibrated: CalibratedVehicle | None = field(init=False)  # the calibration, as the core knows it, limits in force

    def __post_init__(self) -> None:
        calibrated = self.calibration.for_core() if self.calibration else None
        if calibrated is not None:
            calibrated = replace(calibrated, vehicle=self.limits.on(calibrated.vehicle))
        object.__setattr__(self, "calibrated", calibrated)

    @property
    def subject(self) -> Subject:
        """The vehicle that is weighed and the calibration that weighs it."""
        return Subject(self.calibrated, self.estimator, self.identity.vehicle_id)

    @property
    def calibration_id(self) -> str | None:
        """Identifier of the calibration in use; None without one."""
        return self.subject.calibration_id

    def flow(self, settings: BatchSettings) -> Flow:
        """A fresh pipeline."""
        return Flow(settings, self.signal_map.traits, self.calibrated, self.estimator, self.identity)


def load_setup(
    signals: Path | str,
    calibration: Path | str | None = None,
    estimator: str | None = None,
    identity: Identity = NOBODY,
    read: Read = Path.read_bytes,
    limits: Limits = NO_OTHER,
) -> Setup:
    """Load the signal map and the calibration file. Without ``estimator``, the best one of the file is used.

    ``limits`` override those of the calibration. ``read`` reads the files, which may lie in an object store.

    Raises SignalMapError, CalibrationFileError, or ConfigurationError if the file lacks the estimator.
    """
    held = load_calibration(calibration, read) if calibration else None
    chosen = estimator or (held.estimators[0] if held else "cross_spectrum")
    if held and chosen not in held.estimators:
        raise ConfigurationError(
            f"{calibration}: holds no calibration for the estimator {chosen!r}, only for "
            f"{', '.join(held.estimators)}: choose one of these or calibrate again"
        )
    return Setup(load_signal_map(signals, read), held, chosen, identity, limits=limits)


def setup_of(settings: Settings, estimator: str | None = None) -> Setup:
    """The setup that a springscale.toml describes. Raises as :func:`load_setup`, and for another vehicle's file."""
    identity = Identity(settings.vehicle.id, settings.vehicle.vin)
    setup = load_setup(
        settings.signals,
        settings.calibration,
        estimator or settings.estimator,
        identity,
        limits=Limits.of(settings.vehicle),
    )
    wanted = settings.vehicle.calibrated_as
    if wanted and setup.calibration and setup.calibration.vehicle.name != wanted:
        raise ConfigurationError(
            f"{settings.calibration}: was made for the vehicle {setup.calibration.vehicle.name!r}, "
            f"vehicle.calibrated_as says {wanted!r}"
        )
    return setup
