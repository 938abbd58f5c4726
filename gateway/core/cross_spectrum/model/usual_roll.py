"""Default roll parameters of road vehicles: the start of a calibration, and the fallback without a roll rate.

All are chosen as round figures of ordinary cars and vans, not from a table of measured vehicles. In calibration they
are weak priors (calibration.half_car.prior); without a roll rate they determine the interval for a load off the centre
line.
"""

from math import log
from typing import Final

EMPTY_MASS_KG: Final = 1250.0  # chosen: reference of the rates, which scale with mass
GYRATION_PER_TRACK: Final = 0.42  # chosen: radius of gyration in roll
ANTI_ROLL_NPM: Final = 15e3  # chosen: at one front wheel; half of it at the rear
PAYLOAD_GYRATION_M2: Final = 0.15  # chosen: a box one metre wide and high
TRACK_PER_WHEELBASE: Final = 0.54  # chosen: for vans and cars, if not stated


def usual_roll(empty_mass_kg: float, track_width_m: float) -> dict[str, float]:
    """Roll parameters by name, as the parameter vector holds them: logarithms of positive quantities.

    Factors of dampers and the level of twist are 1, and the tracks are as far apart as the wheels. Places of the sensor
    and of the empty body's centre of gravity are not among them, as they are specific to a vehicle.
    """
    scale = empty_mass_kg / EMPTY_MASS_KG
    return {
        "roll_inertia_kgm2": log(empty_mass_kg * (GYRATION_PER_TRACK * track_width_m) ** 2),
        "payload_roll_gyration_m2": log(PAYLOAD_GYRATION_M2),
        "anti_roll_front_npm": log(ANTI_ROLL_NPM * scale),
        "anti_roll_rear_npm": log(0.5 * ANTI_ROLL_NPM * scale),
        "damper_against_front": 0.0,
        "damper_against_rear": 0.0,
        "tracks_apart_m": log(track_width_m),
        "twist_level": 0.0,
        "gyro_yaw_rad": 0.0,
    }
