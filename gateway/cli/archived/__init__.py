"""Commands over a fleet's archive; they want the extra "archive", which no vehicle has."""
