"""The parts of a service, each built from its section of the settings."""

from contextlib import suppress
from functools import partial
from importlib.metadata import version
from pathlib import Path

from gateway.bus.listen import LiveSource, OpenReceiver
from gateway.bus.ring_log import RingLog
from gateway.calibration.file import load_calibration
from gateway.config import BusSection, Settings, StoreSection
from gateway.errors import CalibrationFileError
from gateway.estimates.as_json import read_estimate
from gateway.log import Event, log_event
from gateway.service.calibration_in_use import why_not_learning
from gateway.service.learner.learner import Learner
from gateway.service.learner.van import LearnerVehicle
from gateway.setup import Setup
from gateway.store import Latest, Retention, Store, restored
from gateway.units import BYTES_PER_MB, S_PER_DAY
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings, WebhookSettings
from gateway.uplink.uplink import Uplink
from gateway.uplink.webhook import Webhook
from gateway.web.access.serving import Tls
from gateway.web.live.board import Board
from gateway.web.routes.present_load import Scales
from gateway.weighing.flow import Flow


def uplink_of(
    wanted: UplinkSettings | None, setup: Setup, store: Store, learner: Learner, *, with_places: bool
) -> Uplink | None:
    """The uplink, which hands statements to the learner; None if no broker is configured."""
    if wanted is None:
        return None
    birth = {
        "vehicle_id": setup.identity.vehicle_id,
        "vin": setup.identity.vin,
        "version": version("springscale"),
        "estimator": setup.estimator,
        "calibration_id": setup.calibration_id,
    }
    outbox = Outbox(store, wanted.queue, with_places=with_places, repeat_s=wanted.repeat_s)
    take = partial(learner.loads.import_all, where="the message", may_come_again=True)
    return Uplink(wanted, outbox, birth, take_statements=take)


def webhook_of(wanted: WebhookSettings | None, store: Store, *, with_places: bool) -> Webhook | None:
    """The webhook; None if none is configured."""
    if wanted is None:
        return None
    outbox = Outbox(store, wanted.queue, with_places=with_places, only=wanted.kinds)
    return Webhook(wanted, outbox, store.write_event)


def store_of(wanted: StoreSection, *receivers: UplinkSettings | WebhookSettings | None) -> Store:
    """The store; it keeps the records that a receiver has not received yet."""
    keep = Retention(
        max_age_s=wanted.max_age_days * S_PER_DAY,
        max_bytes=round(wanted.max_size_mb * BYTES_PER_MB),
        undelivered_to=tuple(one.queue for one in receivers if one is not None),
    )
    return Store.open(wanted.directory, keep)


def board_of(stale_after_s: float, store: Store, setup: Setup) -> Board:
    """The board with the last stored estimates; an unreadable disk does not prevent the start."""
    board = Board(
        stale_after_s=stale_after_s, unweighed=Scales(setup.calibrated).weigh(None), is_stored=store.is_stored
    )
    reader = store.reader()
    latest = restored(reader.latest, Latest(None, None, None))
    answer, refusal = (
        text if text and reader.understood([text], read_estimate) else None
        for text in (latest.estimate, latest.rejection)
    )
    board.restore(answer, refusal, latest.age_s)
    heard = board.heard()
    if heard is not None and heard.calibration_id != setup.calibration_id:
        log_event(Event.CALIBRATION_CHANGED, calibration_id=setup.calibration_id, before=heard.calibration_id)
    return board


def learner_of(settings: Settings, by_file: Path | None, setup: Setup, flow: Flow, store: Store) -> Learner:
    """The learner, handed every window of the flow; ``by_file`` is the calibration that the settings name."""
    own_name, like = settings.vehicle.calibrated_as, settings.learning.like
    sister = load_calibration(like).vehicle if like else None
    in_file = None
    if by_file is not None:
        with suppress(CalibrationFileError):  # a service that weighs by what it learnt does not need it
            in_file = load_calibration(by_file).vehicle
    learner = Learner(
        settings.store.directory,
        settings.learning,
        settings.batch.for_core(),
        flow.scheduler,
        setup.signal_map.traits,
        LearnerVehicle(
            id=settings.vehicle.id,
            name=own_name or settings.vehicle.id,
            signals_id=setup.signal_map.id,
            why_not_allowed=why_not_learning(settings),
            is_name_fixed=own_name is not None,
            like=like,
            sister=sister,
            by_file=by_file,
            in_file=in_file,
        ),
        on_event=store.write_event,
    )
    flow.on_window = learner.take
    return learner


def source_of(wanted: BusSection, setup: Setup, open_receiver: OpenReceiver | None) -> LiveSource:
    return LiveSource(
        wanted.interface,
        wanted.channel,
        setup.signal_map,
        options=wanted.options,
        inbox_frames=wanted.inbox_frames,
        silence_s=wanted.silence_s,
        open_receiver=open_receiver,
    )


def ring_log_of(settings: Settings, setup: Setup) -> RingLog | None:
    """The recorder, which records frames with the channel of the signal map; None if nothing is to be recorded."""
    wanted = settings.record
    if not wanted.enabled:
        return None
    max_bytes, free_bytes = round(wanted.max_size_mb * BYTES_PER_MB), round(wanted.free_mb * BYTES_PER_MB)
    directory = wanted.directory or settings.store.directory / "record"
    return RingLog(directory, setup.signal_map.channel or settings.bus.channel, max_bytes, free_bytes)


def tls_of(settings: Settings) -> Tls | None:
    """The certificate files these settings name; None for plain HTTP."""
    web = settings.web
    if web.tls_certificate is None or web.tls_key is None:
        return None
    return Tls(web.tls_certificate, web.tls_key)
