"""The service: one pipeline from bus to web, started and stopped in one place."""
