"""Routes of the calibration in use: known weights, and known loads compared with it.

Requests with a valid token come in; a part of the service answers in JSON, blocking, from a thread of its own; its
refusals go out as problems with a reason.
"""

from gateway.web.routes.calibration.known_weights import KnownWeightService, known_weights_router
from gateway.web.routes.calibration.trend import TrendDesk, trend_router
from gateway.web.routes.calibration.verification import VerificationDesk, verification_router

__all__ = [
    "KnownWeightService",
    "TrendDesk",
    "VerificationDesk",
    "known_weights_router",
    "trend_router",
    "verification_router",
]
