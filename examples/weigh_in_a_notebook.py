"""Measurements in arrays, weights in a table: run it, or paste it into a notebook cell by cell.

Needs `pip install 'springscale[workbench]' pandas`; the workbench only for the simulated drive.
"""

# %% Measurements. Here from the simulator; yours come from a file: SI units, axes up and nose down (ISO 8855).
from importlib.resources import files

import numpy as np
import pandas as pd
import springscale

from gateway.workbench.demo_drive import demo_drive

measured = demo_drive().recording  # 15 minutes empty, a stop to load 270 kg, 10 minutes loaded
t_s = measured.imu_t_ns / 1e9
speed_mps = np.interp(t_s, measured.gps_t_ns / 1e9, measured.gps_speed_mps)  # one row of every array an instant

# %% The vehicle's calibration file, as `springscale calibrate` writes it. Here that of the simulated van.
calibration = springscale.load_calibration(str(files("gateway") / "demo" / "paper_van.json"))

# %% One estimate for every five minutes, rejected ones included with their reasons.
estimates = springscale.estimate_arrays(
    t_s,
    vertical_acceleration_mps2=measured.accel_mps2[:, 2],
    pitch_rate_radps=measured.gyro_radps[:, 1],
    roll_rate_radps=measured.gyro_radps[:, 0],  # as the calibration had one
    speed_mps=speed_mps,
    calibration=calibration,
)

# %% A table.
table = pd.DataFrame(map(springscale.table_row, estimates))
table["t_end"] = pd.to_datetime(table["t_end"])
print(table[["t_end", "payload_kg", "payload_std_kg", "front_share_pct", "rejected"]].to_string(index=False))
