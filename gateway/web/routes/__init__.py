"""What can be asked: one module a subject, each with its addresses and the shapes of its answers.

The live board, the store's reader and the service's status come in; a router a subject goes out, which the application
puts together. Here an estimate becomes weights, metrics, and the words of rFMS, VSS and J1939.
"""

from gateway.web.routes.alarms import AlarmDesk, alarms_router
from gateway.web.routes.cab import cab_router
from gateway.web.routes.calibration import (
    NoTareDesk,
    NoTicketDesk,
    NoVerificationDesk,
    TareDesk,
    TicketDesk,
    TrendDesk,
    VerificationDesk,
    tare_router,
    tickets_router,
    trend_router,
    verification_router,
)
from gateway.web.routes.commissioning import CommissioningDesk, commissioning_router
from gateway.web.routes.estimates import api_router
from gateway.web.routes.events import events_router
from gateway.web.routes.export import export_router
from gateway.web.routes.health import health_router
from gateway.web.routes.j1939 import j1939_router
from gateway.web.routes.known_loads import KNOWN_LOADS_PATH, KnownLoad, KnownLoads, known_loads_router
from gateway.web.routes.metrics import metrics_registry
from gateway.web.routes.reasons import reasons_router
from gateway.web.routes.record import FrameLog, record_router
from gateway.web.routes.rfms import rfms_router
from gateway.web.routes.spectra import spectra_router
from gateway.web.routes.vehicle import vehicle_router
from gateway.web.routes.vss import vss_router
from gateway.web.routes.weights import LatestWeights, Scales, weigh_latest, weights_router

__all__ = [
    "KNOWN_LOADS_PATH",
    "AlarmDesk",
    "CommissioningDesk",
    "FrameLog",
    "KnownLoad",
    "KnownLoads",
    "LatestWeights",
    "NoTareDesk",
    "NoTicketDesk",
    "NoVerificationDesk",
    "Scales",
    "TareDesk",
    "TicketDesk",
    "TrendDesk",
    "VerificationDesk",
    "alarms_router",
    "api_router",
    "cab_router",
    "commissioning_router",
    "events_router",
    "export_router",
    "health_router",
    "j1939_router",
    "known_loads_router",
    "metrics_registry",
    "reasons_router",
    "record_router",
    "rfms_router",
    "spectra_router",
    "tare_router",
    "tickets_router",
    "trend_router",
    "vehicle_router",
    "verification_router",
    "vss_router",
    "weigh_latest",
    "weights_router",
]
