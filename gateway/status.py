"""The service's status as types and as a sentence: the service fills it in, the web sends it unchanged."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field


class State(StrEnum):
    """What the service is doing."""

    STARTING = "starting"
    WAITING_FOR_BUS = "waiting_for_bus"
    SENSOR_FAULT = "sensor_fault"
    WAITING_FOR_SPEED = "waiting_for_speed"
    COLLECTING = "collecting"
    ESTIMATING = "estimating"
    NOT_WEIGHED = "not_weighed"
    STALE = "stale"
    READER_FAULT = "reader_fault"


SENTENCES: Final[dict[State, str]] = {
    State.STARTING: "Starting.",
    State.WAITING_FOR_BUS: "The bus is silent: the vehicle is asleep or the channel is not connected.",
    State.SENSOR_FAULT: "The bus is alive, but a sensor gives no valid sample.",
    State.WAITING_FOR_SPEED: "Sensors are heard; waiting for the vehicle to drive fast enough.",
    State.COLLECTING: "Driving; collecting the first batch.",
    State.ESTIMATING: "Driving; the estimate is kept up to date.",
    State.NOT_WEIGHED: "Driving; the last batch was not weighed. The history has the reasons.",
    State.STALE: "No new estimate for a while: the shown one is old.",
    State.READER_FAULT: "The bus cannot be read: see the last fault.",
}
LOOK: Final = "`springscale look` on a recording of the bus shows under which identifiers its devices send."


SILENT_AFTER_S: Final = 5.0  # chosen: many times the period of any mapped frame


class _Told(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", from_attributes=True)


class BusStatus(_Told):
    """The CAN interface and its frames since the start."""

    interface: str = ""
    channel: str = ""
    state: str = Field("unknown", examples=["connected", "bus_silent", "reader_fault"])
    n_frames: int = Field(0, description="data frames received")
    n_error_frames: int = Field(0, description="error frames received, and messages that no bus can carry")
    n_remote_frames: int = Field(0, description="remote frames received: requests for a message, without its data")
    n_reconnects: int = 0
    n_inbox_dropped: int = Field(0, description="frames the pipeline did not take in time")
    n_kernel_dropped: int | None = Field(None, description="frames the kernel dropped; null if it does not say")
    n_clock_sets: int = Field(
        0, description="times the system's clock dated the stamps of an adapter that counts from its own start"
    )
    last_frame_age_s: float | None = None
    last_fault: str | None = None


class DecodeCount(_Told):
    """How often frames of one signal had one outcome; reason ``ok`` counts the samples."""

    signal: str
    reason: str
    n: int


class SignalHealth(_Told):
    """The recent health of one mapped signal; null is unknown."""

    signal: str = Field(examples=["vertical_acceleration"])
    rate_hz: float | None = None
    last_age_s: float | None = None
    rejected_share: float | None = Field(None, description="share of its frames that gave no sample")

    @property
    def is_silent(self) -> bool:
        """Whether the signal was never received, or not for longer than any signal pauses."""
        return self.last_age_s is None or self.last_age_s > SILENT_AFTER_S


class OwnReading(_Told):
    """The last value of one of the vehicle's own load sensors; it is not part of the estimate."""

    signal: str = Field(examples=["air_spring_pressure"])
    number: float = Field(examples=[412.0])
    unit: str = Field(examples=["kPa"])
    age_s: float


class Standing(_Told):
    """Whether the vehicle stands, and whether the load can have changed since the last weighing."""

    stood_s: float | None = Field(None, description="standstill so far; null: it drives")
    is_load_weighed: bool = Field(
        True, description="false: it has driven on since a stop long enough to load, and that load is not weighed yet"
    )


class BatchCounts(_Told):
    """Batches since the start, by outcome."""

    n_estimates: int = 0
    n_rejected: int = 0
    n_provisional: int = 0
    n_remainders: int = Field(
        0,
        description="windows with too little driving for a batch of their own, pooled with later ones under the "
        "same load",
    )
    n_late_rows: int = Field(0, description="samples that came after their window had ended: no batch has them")
    missing_s: float | None = Field(
        None, description="seconds of usable driving that the next batch still lacks", examples=[42.0]
    )
    rejected_by_reason: dict[str, int] = Field(default_factory=dict)


class StoreState(StrEnum):
    """Whether estimates reach the disk."""

    OK = "ok"
    DEGRADED = "degraded"


@dataclass(frozen=True, slots=True)
class StoreStatus:
    """Whether estimates reach the disk. Degraded: new records are kept in memory, and ``reason`` says why."""

    state: Annotated[str, Field(examples=["ok", "degraded"])] = StoreState.OK
    reason: str | None = None
    n_written: int = 0
    n_held: Annotated[int, Field(description="rows that wait in memory")] = 0
    n_dropped: Annotated[int, Field(description="rows discarded for lack of memory")] = 0
    n_pruned: Annotated[int, Field(description="rows removed by age or size")] = 0
    size_bytes: int = 0
    n_bad_records: Annotated[int, Field(description="records that cannot be used, since the start")] = 0
    set_aside: Annotated[str | None, Field(description="damaged database that the service renamed")] = None
    is_replaced: Annotated[
        bool, Field(description="true: somebody removed the database, or put another in its place, since the start")
    ] = False
    is_reserve_in_use: Annotated[
        bool, Field(description="true: the disk is full, and records go to the room that was kept for them")
    ] = False


@dataclass(frozen=True, slots=True)
class StatementsHeard:
    """Messages of statements that the broker sent down; counts begin at the start."""

    n_taken: Annotated[int, Field(description="all good rows are on disk")] = 0
    n_refused: Annotated[int, Field(description="as a whole, or for some of their rows")] = 0
    last_refusal: Annotated[str | None, Field(description="why; null: none was refused since the start")] = None


@dataclass(frozen=True, slots=True)
class UplinkStatus:
    """How estimates get to the fleet's broker; counts begin at the start, except those that the store keeps."""

    broker: Annotated[str, Field(examples=["fleet.example:8883"])]
    is_connected: bool = False
    n_delivered: Annotated[int, Field(description="acknowledged by the broker")] = 0
    n_refused: Annotated[int, Field(description="given up: the broker will never accept them")] = 0
    n_waiting: Annotated[int, Field(description="stored but not yet delivered; as of a few seconds ago")] = 0
    waiting_age_s: Annotated[
        float | None, Field(description="of the oldest of them, since its receipt; null: none waits")
    ] = None
    n_pruned: Annotated[int, Field(description="removed by retention before they could be delivered")] = 0
    n_connections: int = 0
    n_cuts: Annotated[int, Field(description="times an established link broke")] = 0
    last_fault: Annotated[str | None, Field(description="null while the broker accepts records")] = None
    statements: Annotated[StatementsHeard | None, Field(description="null: none are taken from the broker")] = None


@dataclass(frozen=True, slots=True)
class WebhookStatus:
    """How alarms and events get to the webhook's receiver; counts begin at the start, except those that the store
    keeps.
    """

    receiver: Annotated[str, Field(examples=["https://fleet.example:443"])]
    n_delivered: Annotated[int, Field(description="answered with 2xx")] = 0
    n_failed: Annotated[int, Field(description="attempts that were not")] = 0
    n_dead: Annotated[int, Field(description="messages given up: refused for good, or for too long")] = 0
    n_waiting: Annotated[int, Field(description="still to be delivered; as of a few seconds ago")] = 0
    waiting_age_s: Annotated[
        float | None, Field(description="of the oldest of them, since its receipt; null: none waits")
    ] = None
    n_pruned: Annotated[int, Field(description="removed by retention before they could be delivered")] = 0
    last_fault: Annotated[str | None, Field(description="null while the receiver accepts messages")] = None


@dataclass(frozen=True, slots=True)
class RecordStatus:
    """State of the ring log; counts begin at the start of the service."""

    n_frames_written: int = 0
    n_frames_held: Annotated[int, Field(description="frames that wait in memory to be written")] = 0
    n_frames_dropped: Annotated[int, Field(description="frames lost to a disk that refused")] = 0
    size_bytes: Annotated[int, Field(description="of all files, after the last writing")] = 0
    last_fault: Annotated[str | None, Field(description="why nothing is recorded; null while it is")] = None


@dataclass(frozen=True, slots=True)
class AlarmsStatus:
    """Active alarms; counts begin at the start of the service."""

    active: Annotated[tuple[str, ...], Field(description="names, the oldest first")] = ()
    n_raised: Annotated[int, Field(description="alarms raised since the start")] = 0
    watched: Annotated[tuple[str, ...], Field(description="names of all that are not switched off")] = ()


class Status(_Told):
    """The service as it is now; counts begin at its start."""

    version: str
    state: State
    uptime_s: float
    state_in_words: str = Field("", description="the state as a sentence; derived if left empty")
    vehicle_id: str | None = None
    vin: str | None = None
    calibration_id: str | None = None
    estimator: str | None = None
    bus: BusStatus = BusStatus()
    decode: tuple[DecodeCount, ...] = ()
    signals: tuple[SignalHealth, ...] = ()
    own_readings: tuple[OwnReading, ...] = Field((), description="of the vehicle's own load sensors, where mapped")
    standing: Standing = Standing()
    batches: BatchCounts = BatchCounts()
    store: StoreStatus = StoreStatus()
    uplink: UplinkStatus | None = Field(None, description="null if no broker is configured")
    webhook: WebhookStatus | None = Field(None, description="null if none is configured")
    record: RecordStatus | None = Field(None, description="the ring log; null if it is off")
    alarms: AlarmsStatus = AlarmsStatus()
    is_ready: bool = Field(True, description="whether estimates are possible: the answer of /health/ready")
    not_ready_reason: str | None = None
    warnings: tuple[str, ...] = Field((), description="faults that do not stop the weighing, and how to mend them")

    def model_post_init(self, _context: object) -> None:
        if not self.state_in_words:
            object.__setattr__(self, "state_in_words", self.sentence())

    def sentence(self) -> str:
        """The state in words, with any faults."""
        is_silent = self.state is State.WAITING_FOR_BUS and self.bus.last_fault
        said = [f"No mapped frame comes: {self.bus.last_fault}." if is_silent else SENTENCES[self.state]]
        silent = [f"{s.signal.replace('_', ' ')}{self.why_silent(s)}" for s in self.signals if s.is_silent]
        if silent and self.state is State.SENSOR_FAULT:
            said.append(f"Missing: {', '.join(silent)}.")
        if self.state is State.SENSOR_FAULT or (self.state is State.WAITING_FOR_BUS and not self.bus.n_frames):
            said.append(LOOK)
        if self.state is State.READER_FAULT and self.bus.last_fault:
            said.append(f"Last fault: {self.bus.last_fault}.")
        if self.calibration_id is None:
            said.append("No calibration: spectra only, no payload.")
        said += [f"{warning[:1].upper()}{warning[1:]}." for warning in self.warnings]
        return " ".join(said)

    def why_silent(self, silent: SignalHealth) -> str:
        """Behind its name: no frame of its message, or frames without a valid sample; empty: it was received."""
        counts = {row.reason: row.n for row in self.decode if row.signal == silent.signal}
        n_refused = sum(n for reason, n in counts.items() if reason != "ok")
        if not counts or counts.get("ok"):
            return ""
        if n_refused:
            reasons = " and ".join(reason.replace("_", " ") for reason, n in counts.items() if n and reason != "ok")
            return f" ({n_refused} frames came, all {reasons})"
        return " (no frame of its message)"


def judged(status: Status, faults: Sequence[str]) -> Status:
    """The status with its verdicts: whether it is ready, and the warnings. They depend on the status and on ``faults``,
    those of parts that it does not tell of, and on nothing else.
    """
    not_ready = why_not_ready(status)
    warnings = (*faults_of(status), *faults)
    told = status.model_copy(
        update={"is_ready": not_ready is None, "not_ready_reason": not_ready, "warnings": warnings}
    )
    return told.model_copy(update={"state_in_words": told.sentence()})


def why_not_ready(status: Status) -> str | None:
    """Why no estimate is possible, or none is kept; None otherwise. A sleeping bus or a parked vehicle is no reason."""
    if status.state is State.READER_FAULT:
        return status.bus.last_fault or "the bus cannot be read"
    if status.calibration_id is None:
        return (
            "no calibration: batches carry spectra only; teach the vehicle on /teach, or name a calibration file in "
            "the configuration"
        )
    if status.store.state != StoreState.OK:
        return f"estimates do not reach the disk: {status.store.reason}"
    return None


def faults_of(status: Status) -> Iterator[str]:
    """What is wrong with the parts that the status tells of, as sentences; none of it stops the weighing."""
    store, uplink, webhook, record = status.store, status.uplink, status.webhook, status.record
    if store.state != StoreState.OK:
        yield f"estimates are kept in memory only ({store.reason}): {store.n_held} are not stored"
    if store.is_reserve_in_use:
        yield "the disk is full: records go to the last megabytes that were kept for them; make room"
    if store.n_dropped:
        yield f"{store.n_dropped} records are lost: the disk refused them for longer than memory holds them"
    if store.set_aside:
        yield f"the database was damaged and is kept as {store.set_aside}; the history begins anew"
    if store.is_replaced:
        yield "the database was removed or replaced while the service ran; the history is that of the present one"
    if uplink is not None and uplink.last_fault:
        yield f"the fleet's broker takes no records ({uplink.last_fault}); {uplink.n_waiting} wait"
    if webhook is not None and webhook.last_fault:
        yield f"the webhook takes no messages ({webhook.last_fault}); {webhook.n_waiting} wait"
    if record is not None and record.last_fault:
        yield (
            f"frames are not being recorded ({record.last_fault}); {record.n_frames_dropped} are lost so far, "
            "weighing goes on"
        )
