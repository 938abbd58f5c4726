"""The campaign file: which drives were recorded, with which vehicle and load."""

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from gateway.calibration.axle_weights import payload_range_keys, sprung_keys
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.calibration.statements import (
    KNOWN_PLACE_PLUS_MINUS_M,
    KNOWN_PLUS_MINUS_KG,
    KNOWN_SHARE_PLUS_MINUS_PCT,
    UNKNOWN_LEFT_STD_M,
    is_in_tonnes,
)
from gateway.core.vehicle import (
    Kilograms,
    Metres,
    MetresLeft,
    Percent,
    Vehicle,
    cg_left_m,
    front_share_pct,
    left_share_pct,
)
from gateway.core.weights.on_the_road import unsprung_kg
from gateway.errors import CampaignError
from gateway.files.toml_file import checked, read_toml
from gateway.records import Batch

OnRun = Callable[[int, int], None]  # (runs done, runs in all)


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class RunTable(_Table):
    """[[runs]]: one drive and what is known of its load."""

    log: Path = Field(description="its log: candump text, .asc, .blf, .mf4 or .trc, each also as .gz, .zst or .xz")
    payload_kg: Kilograms | None = Field(
        None, description="load in addition to the empty vehicle: L; 0 for an empty run; absent: unknown"
    )
    payload_plus_minus_kg: float = Field(
        KNOWN_PLUS_MINUS_KG,
        gt=0.0,
        le=100_000.0,
        description="half the 95 % interval of `payload_kg`; 25 or more for a delivery note",
    )
    payload_position_m: Metres | None = Field(
        None,
        description="its centre of gravity behind the front axle: d; absent, and no `front_share_pct`: unknown",
    )
    payload_position_plus_minus_m: float = Field(
        KNOWN_PLACE_PLUS_MINUS_M, gt=0.0, le=20.0, description="half the 95 % interval of `payload_position_m`"
    )
    front_share_pct: Percent | None = Field(
        None, description="share of the whole sprung mass on the front axle, in place of the position"
    )
    payload_left_m: MetresLeft | None = Field(
        None,
        description="its centre of gravity left of the vehicle's centre line, negative: right of it; absent: about "
        f"there, with a standard deviation of {UNKNOWN_LEFT_STD_M:g} m",
    )
    split: Literal["identification", "validation"] | None = Field(
        None, description="use the whole run for this alone; absent: cut at `identification_fraction`"
    )
    start_s: float = Field(
        0.0, ge=0.0, description="start of the piece, after the first frame that the signal map reads"
    )
    end_s: float | None = Field(None, gt=0.0, description="end so long after that frame; after `start_s`")

    @model_validator(mode="after")
    def _is_complete(self) -> "RunTable":
        places = ("payload_position_m", "front_share_pct", "payload_left_m", "payload_plus_minus_kg")
        if self.payload_kg is None and (stated := [name for name in places if name in self.model_fields_set]):
            raise ValueError(f"{stated[0]} says nothing without payload_kg: state it, or leave both out")
        if self.payload_position_m is not None and self.front_share_pct is not None:
            raise ValueError("give payload_position_m or front_share_pct, not both")
        if self.end_s is not None and self.end_s <= self.start_s:
            raise ValueError("end_s must be after start_s")
        return self


class CampaignTable(_Table):
    """The whole file."""

    signals: str = Field(min_length=1, description="the signal map: a path, or `springscale:NAME` for a shipped one")
    identification_fraction: float = Field(
        0.667, ge=0.0, le=1.0, description="first part of each run that identifies; the rest validates"
    )
    vehicle: Vehicle = Field(description="the vehicle, empty")
    runs: tuple[RunTable, ...] = Field(min_length=1, description="the drives, numbered from 1 in this order")


class DraftTable(CampaignTable):
    """A campaign file in which signals and runs may still be missing."""

    signals: str = ""
    runs: tuple[RunTable, ...] = ()


class Campaign:
    """A campaign file with its paths resolved and its vehicle in the core's terms."""

    def __init__(self, path: Path, table: CampaignTable, *, states_payload_range: bool = True) -> None:
        self.path = path
        self.runs = table.runs
        self.identification_fraction = table.identification_fraction
        self.vehicle = table.vehicle
        self.states_payload_range = states_payload_range
        self._signals = table.signals

    @property
    def signals(self) -> str:
        """The signal map: a path, or springscale:NAME; empty if a draft names none."""
        is_path = self._signals and not self._signals.startswith("springscale:")
        return str(self.path.parent / self._signals) if is_path else self._signals

    def log_of(self, run: RunTable) -> Path:
        """Path of the run's log."""
        return self.path.parent / run.log

    def front_share_pct(self, run: RunTable) -> float:
        """The run's true share of the sprung mass on the front axle, equation (3); NaN if it is not known."""
        if run.front_share_pct is not None:
            return run.front_share_pct
        if run.payload_kg is None or (run.payload_kg > 0.0 and run.payload_position_m is None):
            return math.nan
        return front_share_pct(self.vehicle, run.payload_kg, run.payload_position_m)

    def drive(self, number: int, run: RunTable, batches: tuple[Batch, ...]) -> StatedDrive:
        """The batches of a run with what is known of its load."""
        payload_kg = math.nan if run.payload_kg is None else run.payload_kg
        share_plus_minus_pct = KNOWN_SHARE_PLUS_MINUS_PCT
        if "payload_position_plus_minus_m" in run.model_fields_set and payload_kg > 0.0:
            arm = run.payload_position_plus_minus_m / self.vehicle.wheelbase_m
            share_plus_minus_pct = 100.0 * arm * payload_kg / (self.vehicle.empty_mass_kg + payload_kg)
        return known_drive(
            number,
            str(run.log),
            payload_kg,
            self.front_share_pct(run),
            batches,
            run.payload_left_m,
            run.payload_plus_minus_kg,
            share_plus_minus_pct,
        )


def load_campaign(path: Path, *, is_draft: bool = False) -> Campaign:
    """Raises CampaignError naming every fault of the file, logs that are not there and loads that cannot be.

    A draft may lack signals and runs.
    """
    tables = _completed(read_toml(path, CampaignError), path)
    table = checked(tables, path, DraftTable if is_draft else CampaignTable, CampaignError)
    campaign = Campaign(path, table, states_payload_range="payload_range_kg" in tables["vehicle"])
    faults = [f"{path}: vehicle.{fault}" for fault in _range_faults(campaign.vehicle)]
    faults += [
        f"{path}: runs[{i}].{fault}" for i, run in enumerate(campaign.runs, 1) for fault in _faults(campaign, run)
    ]
    if faults:
        raise CampaignError("\n".join(faults))
    return campaign


def _completed(tables: dict[str, Any], path: Path) -> dict[str, Any]:
    """With what follows from the axle weights, where it is not stated itself."""
    vehicle = tables.get("vehicle")
    if not isinstance(vehicle, dict):
        return tables
    front_kg, rear_kg = (vehicle.get(f"kerb_{end}_axle_kg") for end in ("front", "rear"))
    if not (isinstance(front_kg, int | float) and isinstance(rear_kg, int | float)):
        return tables
    limit_kg = vehicle.get("gross_limit_kg")
    follows = payload_range_keys(front_kg, rear_kg, limit_kg) if isinstance(limit_kg, int | float) else {}
    if "empty_mass_kg" not in vehicle:
        try:
            follows |= sprung_keys(front_kg, rear_kg, vehicle.get("unsprung_front_kg"), vehicle.get("unsprung_rear_kg"))
        except CampaignError as fault:
            raise CampaignError(f"{path}: vehicle.kerb_front_axle_kg: {fault}") from None
    return {**tables, "vehicle": follows | vehicle}


def _range_faults(vehicle: Vehicle) -> Iterator[str]:
    most_kg = vehicle.payload_range_kg[1]
    if is_in_tonnes(most_kg, vehicle):
        yield f"payload_range_kg: {most_kg:g} kg is no load of a vehicle of {vehicle.empty_mass_kg:g} kg; tonnes?"
    for end, unsprung in zip(("front", "rear"), unsprung_kg(vehicle), strict=True):
        if unsprung <= 0.0:
            yield (
                f"kerb_{end}_axle_kg: is {-unsprung:g} kg less than the load on this axle by empty_mass_kg and "
                f"empty_front_share_pct: scales also include axle and wheels; leave "
                f"both out, and they follow from the axle weights"
            )


def _faults(campaign: Campaign, run: RunTable) -> Iterator[str]:
    if not campaign.log_of(run).is_file():
        yield f"log: {run.log}: no such file"
    if run.payload_kg is None:
        return
    if is_in_tonnes(run.payload_kg, campaign.vehicle):
        yield (
            f"payload_kg: {run.payload_kg:g} kg is no load of a vehicle of {campaign.vehicle.empty_mass_kg:g} kg: "
            f"write {1000.0 * run.payload_kg:g} if these are tonnes, 0 if it was empty"
        )
    share_pct = campaign.front_share_pct(run)
    if share_pct <= 0.0 or share_pct >= 100.0:
        yield (
            f"payload_position_m: {run.payload_kg:g} kg at {run.payload_position_m:g} m would put {share_pct:.0f} % of "
            "the weight on the front axle and lift the other; it is measured from the front axle rearwards"
        )
    left_m, track_m = run.payload_left_m, campaign.vehicle.track_width_m
    if left_m is not None and track_m is not None:
        share_pct = left_share_pct(cg_left_m(campaign.vehicle, run.payload_kg, left_m), track_m)
        if not 0.0 < share_pct < 100.0:
            yield (
                f"payload_left_m: {run.payload_kg:g} kg at {left_m:g} m would put {share_pct:.0f} % of the weight on "
                "the left wheels and lift the others; it is measured from the centre line to the left"
            )


def chosen_runs(campaign: Campaign, numbers: Sequence[int] | None) -> list[tuple[int, RunTable]]:
    """Runs with their numbers from 1; all, or those named. Raises CampaignError for a number that is not there."""
    numbered = list(enumerate(campaign.runs, 1))
    if numbers is None:
        return numbered
    unknown = [n for n in numbers if not 1 <= n <= len(numbered)]
    if unknown:
        raise CampaignError(f"{campaign.path}: there is no run {unknown[0]}: runs are numbered 1 to {len(numbered)}")
    return [numbered[n - 1] for n in dict.fromkeys(numbers)]


def file_sha256(path: Path) -> str:
    """Hex digest of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
