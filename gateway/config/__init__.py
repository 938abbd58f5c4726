"""springscale.toml and SPRINGSCALE_* variables -> frozen settings. An unknown key is an error that names it.

Tables about the vehicle, its bus and its batches, the web and the store are here, the others in ``sections``.
"""

import os
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeVar, get_args

from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

from gateway.config.sections import (
    OF_CALIBRATION,
    AlarmsSection,
    HostName,
    LearningSection,
    LimitKg,
    PositionSection,
    RecordSection,
    Seconds,
    SettingsSection,
    UplinkSection,
    WebhookSection,
)
from gateway.core.batch_settings import BatchSettings
from gateway.errors import ConfigurationError
from gateway.files.toml_file import SIMILAR, describe_faults, read_toml

Section = TypeVar("Section", bound=BaseModel)
Share = Annotated[float, Field(gt=0.0, le=1.0)]
VEHICLE_ID: Final = r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}"  # as deploy/fleet/provision.py has it

EstimatorName = Literal["cross_spectrum", "ratio_index"]  # those of weighing.estimator, which loads too much for this
ESTIMATOR_NAMES: tuple[EstimatorName, ...] = get_args(EstimatorName)


class VehicleSection(SettingsSection):
    """The vehicle's identity, and its limits."""

    id: str = Field(
        "vehicle",
        pattern=f"^{VEHICLE_ID}$",
        description="name under which the fleet knows the vehicle: letters, digits, `.`, `_` and `-`",
    )
    calibrated_as: str | None = Field(
        None, description="the vehicle's name in its calibration file; if set, another vehicle's file is refused"
    )
    vin: str | None = Field(
        None, pattern=r"^[A-HJ-NPR-Z0-9]{17}$", description="vehicle identification number (ISO 3779)"
    )
    gross_limit_kg: LimitKg = Field(None, description=f"permitted gross weight {OF_CALIBRATION}")
    front_axle_limit_kg: LimitKg = Field(None, description=f"permitted load of the front axle {OF_CALIBRATION}")
    rear_axle_limit_kg: LimitKg = Field(None, description=f"permitted load of the rear axle {OF_CALIBRATION}")
    front_wheel_limit_kg: LimitKg = Field(
        None, description=f"permitted load of each front wheel or its tyre, both of twin tyres {OF_CALIBRATION}"
    )
    rear_wheel_limit_kg: LimitKg = Field(None, description=f"the same at the rear {OF_CALIBRATION}")


class BusSection(SettingsSection):
    """The source of the frames."""

    interface: str = Field("socketcan", description="any python-can interface: socketcan, slcan, pcan, virtual, ...")
    channel: str = Field("can0", description="channel of that interface")
    options: dict[str, str | int | float | bool] = Field(
        default_factory=dict, description="further arguments of that python-can interface, e.g. bitrate"
    )
    inbox_frames: int = Field(
        65_536, ge=1024, le=16_777_216, description="frames queued between reader and pipeline; more are dropped"
    )
    silence_s: Seconds = Field(2.0, description="the bus counts as silent (asleep) after this long without a frame")


class BatchSection(SettingsSection):
    """How batches are formed and gated."""

    window_s: float = Field(300.0, ge=20.0, le=3600.0, description="length of a batch")
    rate_hz: float = Field(50.0, ge=40.0, le=200.0, description="rate of the uniform time line")
    speed_min_mps: float = Field(5.0, ge=0.5, description="slower samples are masked")
    speed_max_mps: float = Field(40.0, le=100.0, description="faster samples are masked")
    usable_share_min: Share = Field(0.6, description="a batch counts with at least this share of usable samples")
    gap_share_max: Share = Field(0.2, description="a batch with a larger share of gaps is refused")
    last_batch_share_min: Share = Field(
        0.95, description="the last batch of a drive counts if it has at least this share of the window"
    )
    standstill_s: Seconds = Field(60.0, description="a standstill this long ends the drive")
    standstill_speed_mps: float = Field(0.5, gt=0.0, le=100.0, description="slower than this is standing")
    silence_s: Seconds = Field(10.0, description="this long without a mapped frame ends the drive")
    clock_step_s: Seconds = Field(1.0, description="a step back of the time stamps larger than this ends the drive")
    gap_s: Seconds = Field(0.05, description="samples further apart than this leave a gap")
    speed_hold_s: Seconds = Field(3.0, description="speed samples further apart than this leave a gap")
    stuck_s: Seconds = Field(5.0, description="a sensor that repeats one number for this long is stuck")
    speed_frozen_s: Seconds = Field(60.0, description="a GNSS speed that repeats one number for this long is frozen")
    provisional_every_s: float = Field(
        60.0,
        ge=0.0,
        le=1e9,
        description="the service looks at a growing window this often (0: never); offline tools do not",
    )

    @model_validator(mode="after")
    def _consistent(self) -> "BatchSection":
        if self.speed_min_mps >= self.speed_max_mps:
            raise ValueError("speed_min_mps must be below speed_max_mps")
        if self.silence_s >= self.window_s:
            raise ValueError("silence_s must be below window_s")
        if 0.0 < self.provisional_every_s < 1.0:
            raise ValueError("provisional_every_s must be 0 or at least 1")
        return self

    def for_core(self, *, window_s: float | None = None, is_live: bool = False) -> BatchSettings:
        """These settings for the core; provisional looks belong to the live service alone."""
        chosen = self.model_dump()
        chosen["window_s"] = window_s or self.window_s
        chosen["provisional_every_s"] = self.provisional_every_s if is_live else 0.0
        return BatchSettings(**chosen)


class WebSection(SettingsSection):
    """The HTTP side."""

    host: HostName = Field("127.0.0.1", description="address to listen on")
    port: int = Field(8000, ge=0, le=65535, description="port to listen on; 0 takes a free one")
    stale_after_s: Seconds = Field(900.0, description="an estimate older than this is marked stale")
    tls_certificate: Path | None = Field(None, description="PEM file of the certificate chain; makes it HTTPS")
    tls_key: Path | None = Field(None, description="PEM file of the certificate's private key")

    @model_validator(mode="after")
    def _whole_tls(self) -> "WebSection":
        if (self.tls_certificate is None) != (self.tls_key is None):
            raise ValueError("tls_certificate and tls_key belong together: give both or neither")
        return self


class StoreSection(SettingsSection):
    """Where estimates are kept."""

    directory: Path = Field(Path("/var/lib/springscale"), description="folder of the database")
    max_age_days: float = Field(400.0, gt=0.0, le=36_500.0, description="older records are removed")
    max_size_mb: float = Field(512.0, ge=4.0, le=1e9, description="the oldest records are removed beyond this size")


class LogSection(SettingsSection):
    """The content of the service's log."""

    level: Literal["debug", "info", "warning", "error"] = Field("info", description="least level that is written")


PREFIX: Final = "SPRINGSCALE_"  # of variables in the environment


class Settings(BaseSettings):
    """springscale.toml. Paths in it are relative to the file."""

    model_config = SettingsConfigDict(
        frozen=True,
        extra="forbid",
        env_prefix=PREFIX,
        env_nested_delimiter="__",
        nested_model_default_partial_update=True,
    )

    signals: str = Field(description="signal map: a TOML file, or springscale:NAME for a shipped one")
    calibration: Path | None = Field(None, description="calibration file; without it batches carry spectra only")
    estimator: EstimatorName = Field("cross_spectrum", description="which estimator answers")
    vehicle: VehicleSection = VehicleSection()
    bus: BusSection = BusSection()
    batch: BatchSection = BatchSection()
    web: WebSection = WebSection()
    store: StoreSection = StoreSection()
    record: RecordSection = RecordSection()
    learning: LearningSection = LearningSection()
    position: PositionSection = PositionSection()
    alarms: AlarmsSection = AlarmsSection()
    uplink: UplinkSection = UplinkSection()
    webhook: WebhookSection = WebhookSection()
    log: LogSection = LogSection()

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """The environment wins over the file."""
        return env_settings, init_settings


def load_settings(path: Path) -> Settings:
    """Settings of ``path`` and the environment, paths made absolute. Raises ConfigurationError naming every fault."""
    _refuse_misspelt(os.environ)
    tables = read_toml(path)
    try:
        settings = Settings(**tables)
    except ValidationError as fault:
        raise ConfigurationError(describe_faults(path, fault, Settings)) from None
    return _with_absolute_paths(settings, path.resolve().parent)


def _refuse_misspelt(environment: Iterable[str]) -> None:
    """Raise ConfigurationError for variables that look like settings and are none, which pydantic would ignore."""
    fields = Settings.model_fields
    keys = [name for name, field in fields.items() if not isinstance(field.default, BaseModel)]
    for name in environment:
        table, separator, rest = name.lower().removeprefix(PREFIX.lower()).partition("__")
        meant = get_close_matches(table, list(fields) if separator else keys, 1, SIMILAR)
        if name.upper().startswith(PREFIX) and table not in fields and (separator or meant):
            hint = f"did you mean {PREFIX}{f'{meant[0]}{separator}{rest}'.upper()}?" if meant else "remove it"
            raise ConfigurationError(f"{name} in the environment is no setting; {hint}")


def _with_absolute_paths(settings: Settings, folder: Path) -> Settings:
    """Every path of the settings, relative to the folder of the configuration file."""
    absolute = _absolute(settings, folder)
    if settings.signals.startswith("springscale:"):
        return absolute
    return absolute.model_copy(update={"signals": str(folder / settings.signals)})


def _absolute(section: Section, folder: Path) -> Section:
    changed: dict[str, Any] = {}
    for name, value in section:
        if isinstance(value, Path):
            changed[name] = folder / value
        elif isinstance(value, BaseModel):
            changed[name] = _absolute(value, folder)
    return section.model_copy(update=changed)
