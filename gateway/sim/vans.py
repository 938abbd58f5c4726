"""Vehicles ready to drive. Masses and places of the paper's van are its Table 1; the rest is ours.

Imbalance is what balancing leaves: about 10 g on each side of a rim of 0.19 m, more on larger wheels.
"""

from typing import Final

from gateway.sim.parameters import Axle, Damper, Spring, Vehicle, Wheel

PAPER_VAN: Final = Vehicle(
    name="paper_van",  # Table 1, its unsprung mass read as 4 x 40 kg; springs of a laden 2 Hz van
    sprung_kg=1240.0,
    pitch_inertia_kgm2=2975.0,
    roll_inertia_kgm2=486.0,
    wheelbase_m=2.8,
    cog_position_m=1.4,
    cog_height_m=0.70,
    front=Axle(
        Spring(40e3, progression_npm2=1e5, bump_clearance_m=0.060),
        Damper(1600.0, 2600.0, digression=0.6, friction_n=30.0),
        Wheel(40.0, 190e3, radius_m=0.30, imbalance_kgm=0.004, runout_m=0.0002),
        track_m=1.50,
        anti_roll_npm=12e3,
    ),
    rear=Axle(
        Spring(50e3, progression_npm2=3e5, bump_clearance_m=0.075),
        Damper(1500.0, 2400.0, digression=0.6, friction_n=40.0),
        Wheel(40.0, 190e3, radius_m=0.30, imbalance_kgm=0.004, runout_m=0.0002),
        track_m=1.50,
        anti_roll_npm=4e3,
    ),
    rated_payload_kg=450.0,
)

SMALL_VAN: Final = Vehicle(
    name="small_van",  # engine and driver in front: 61 % of the empty sprung mass on the front axle
    sprung_kg=1180.0,
    pitch_inertia_kgm2=1950.0,
    roll_inertia_kgm2=450.0,
    wheelbase_m=2.70,
    cog_position_m=1.05,
    cog_height_m=0.62,
    front=Axle(
        Spring(30e3, progression_npm2=8e4, bump_clearance_m=0.060),
        Damper(1300.0, 2300.0, digression=0.55, friction_n=35.0),
        Wheel(42.0, 200e3, radius_m=0.31, imbalance_kgm=0.004, runout_m=0.0002),
        track_m=1.51,
        anti_roll_npm=14e3,
    ),
    rear=Axle(
        Spring(27e3, progression_npm2=4e5, bump_clearance_m=0.085),
        Damper(1100.0, 1900.0, digression=0.6, friction_n=60.0),
        Wheel(38.0, 210e3, radius_m=0.31, imbalance_kgm=0.004, runout_m=0.0002),
        track_m=1.51,
        anti_roll_npm=5e3,
    ),
    rated_payload_kg=650.0,
)

LARGE_VAN: Final = Vehicle(
    name="large_van",  # 3.5 t class, twin coil front, leaf rear with a helper that stiffens it
    sprung_kg=1850.0,
    pitch_inertia_kgm2=5200.0,
    roll_inertia_kgm2=900.0,
    wheelbase_m=3.65,
    cog_position_m=1.45,
    cog_height_m=0.78,
    front=Axle(
        Spring(46e3, progression_npm2=1.5e5, bump_clearance_m=0.065),
        Damper(2000.0, 3600.0, digression=0.55, friction_n=60.0),
        Wheel(62.0, 270e3, radius_m=0.34, imbalance_kgm=0.006, runout_m=0.0003),
        track_m=1.74,
        anti_roll_npm=25e3,
    ),
    rear=Axle(
        Spring(48e3, progression_npm2=6e5, bump_clearance_m=0.100),
        Damper(1800.0, 3200.0, digression=0.6, friction_n=120.0),
        Wheel(70.0, 290e3, radius_m=0.34, imbalance_kgm=0.006, runout_m=0.0003),
        track_m=1.72,
        anti_roll_npm=8e3,
    ),
    rated_payload_kg=1300.0,
)

VANS: Final = {van.name: van for van in (PAPER_VAN, SMALL_VAN, LARGE_VAN)}
