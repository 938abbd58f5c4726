"""What can be asked about the calibration in use, and changed: known weights, and known loads held against it.

Requests with a good token come in; who keeps these things (a desk of the service) answers in JSON, blocking, from a
thread of its own; its refusals go out as problems with a reason.
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
