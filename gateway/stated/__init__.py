"""What people state of a vehicle and of a load, as the web takes and shows it and calibration uses it."""
