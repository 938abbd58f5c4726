"""CAN in: live sources, logs, and the decoder that turns frames into SI samples."""
