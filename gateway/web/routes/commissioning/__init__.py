"""/api/v1/calibration/commissioning: a vehicle calibrated on its own machine, step by step.

``steps`` has the addresses, ``shapes`` the requests and answers; the service implements them.
"""

from gateway.web.routes.commissioning.shapes import CommissioningState, LinesFound
from gateway.web.routes.commissioning.steps import (
    COMMISSIONING_PATH,
    CommissioningDesk,
    commissioning_router,
)

__all__ = [
    "COMMISSIONING_PATH",
    "CommissioningDesk",
    "CommissioningState",
    "LinesFound",
    "commissioning_router",
]
