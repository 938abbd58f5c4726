"""Pure estimation: arrays in, numbers out. No clock, no files, no bus."""
