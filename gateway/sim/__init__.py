"""A test bench of our own: road, vehicle, sensors, drives. Shares no model with core."""
