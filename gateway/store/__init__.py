"""Estimates and events on disk (SQLite)."""
