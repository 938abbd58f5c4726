"""Estimates over HTTP (FastAPI)."""
