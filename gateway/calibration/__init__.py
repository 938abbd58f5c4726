"""From known-load drives to a vehicle calibration file."""
