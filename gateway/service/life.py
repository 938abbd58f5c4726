"""A service's life: one gateway after the other, each with the calibration that is in use when it begins."""

from gateway.bus.live import OpenReceiver
from gateway.config import Settings
from gateway.service.commissioning import commissioned, with_commissioned
from gateway.service.gateway import Gateway, OnStarted
from gateway.service.reload import LoadSettings
from gateway.web import forget_routes


def live(
    settings: Settings,
    load: LoadSettings,
    *,
    on_started: OnStarted = lambda gateway: None,
    open_receiver: OpenReceiver | None = None,
) -> None:
    """Serve until told to stop. Raises as ``setup_of`` and as :meth:`Gateway.run`.

    A calibration made on the vehicle is taken up between two drives, where no window is open: the parts stop and begin
    anew, within a second or two, as at any start. ``load`` reads the settings anew for a reload; ``open_receiver`` is
    as of :class:`Gateway`.
    """
    while True:
        chosen, setup, fault = commissioned(settings)
        gateway = Gateway(
            chosen,
            setup,
            load=lambda: with_commissioned(load()),
            setup_fault=fault,
            on_started=on_started,
            open_receiver=open_receiver,
        )
        gateway.run()
        if not gateway.is_to_start_anew:
            return
        del gateway
        forget_routes()
