"""Springscale: weighs a vehicle by listening to its springs."""
