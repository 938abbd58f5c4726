"""How road vehicles roll, before one has been driven: what a model of roll begins with, and falls back on.

Chosen, all of them, as round figures of ordinary cars and vans: no table of measured vehicles stands behind them.
Calibration holds them by no more than calibration.half_car.prior says; without a roll rate they are what the interval
of a load to one side is reckoned with.
"""

from math import log
from typing import Final

EMPTY_MASS_KG: Final = 1250.0  # of the vehicle that the rates are of; they scale with mass
GYRATION_PER_TRACK: Final = 0.42  # radius of gyration in roll
ANTI_ROLL_NPM: Final = 15e3  # as one wheel feels it, in front; half of it behind
PAYLOAD_GYRATION_M2: Final = 0.15  # a box one metre wide and high
TRACK_PER_WHEELBASE: Final = 0.54  # of vans and cars where nobody stated it


def usual_roll(empty_mass_kg: float, track_width_m: float) -> dict[str, float]:
    """Roll parameters by name, as the parameter vector holds them: logarithms where these are positive.

    Factors of dampers and the level of twist are 1, and the tracks are as far apart as the wheels. Where the sensor and
    the empty body's centre of gravity are, no vehicle tells of another.
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
