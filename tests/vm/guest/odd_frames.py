"""Puts onto vcan0 what a listener may meet beside data frames: error, remote and CAN FD frames, n of each kind."""

import socket
import struct
import sys
import time

MAPPED_ID = 0x120
ERROR_FLAG, REMOTE_FLAG = 0x2000_0000, 0x4000_0000
BUS_OFF, CONTROLLER = 0x040, 0x004


def classic(can_id, payload):
    return struct.pack("=IB3x8s", can_id, len(payload), payload)


def can_fd(can_id, payload):
    return struct.pack("=IBB2x64s", can_id, len(payload), 1, payload)


KINDS = {
    "error": lambda: classic(ERROR_FLAG | CONTROLLER, bytes(8)),
    "bus_off": lambda: classic(ERROR_FLAG | BUS_OFF, bytes(8)),
    "remote": lambda: classic(REMOTE_FLAG | MAPPED_ID, b""),
    "fd_other": lambda: can_fd(0x321, bytes(range(64))),
    "fd_mapped": lambda: can_fd(MAPPED_ID, bytes(range(64))),
    "short": lambda: classic(MAPPED_ID, b"\1\2"),
}

with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
    bus.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
    bus.bind(("vcan0",))
    n, kinds = int(sys.argv[1]), sys.argv[2:]
    for _ in range(n):
        for kind in kinds:
            bus.send(KINDS[kind]())
        time.sleep(0.005)
