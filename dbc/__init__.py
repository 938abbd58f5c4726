"""Our own CAN databases and signal maps, for devices that people can buy."""
