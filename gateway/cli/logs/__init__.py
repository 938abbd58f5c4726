"""Commands that make, pack or read recordings without a service, and the one that feeds sensors onto a bus."""
