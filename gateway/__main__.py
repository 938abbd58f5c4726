"""python -m gateway is springscale."""

from gateway.cli import main

main()
