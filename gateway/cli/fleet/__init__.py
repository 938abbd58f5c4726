"""Commands for many vehicles at once."""
