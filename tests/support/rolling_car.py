"""A rolling car whose every part counts: no two axles, tracks or places alike."""

from gateway.core.cross_spectrum.model.rolling_car import Against, RollingCar
from support.half_car_road import CAR

HALF_TRACK_M = 0.75
ROLLING_CAR = RollingCar(
    half_car=CAR,
    half_track_m=HALF_TRACK_M,
    roll_inertia_kgm2=480.0,
    payload_roll_gyration_m2=0.12,
    front=Against(24e3, 0.9),
    rear=Against(9e3, 1.1),
    sensor_left_m=0.3,
    gyro_yaw_rad=0.02,
    empty_left_m=0.01,
)
