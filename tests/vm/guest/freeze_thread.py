"""Stops one thread of a process, and that one alone, for good: python3 freeze_thread.py PID THREAD_NAME."""

import ctypes
import os
import sys
from pathlib import Path

PTRACE_ATTACH = 16
WALL = 0x4000_0000  # threads too

process, name = sys.argv[1:3]
threads = Path("/proc", process, "task").iterdir()
chosen = next(int(thread.name) for thread in threads if (thread / "comm").read_text().strip() == name)
libc = ctypes.CDLL(None, use_errno=True)
if libc.ptrace(PTRACE_ATTACH, chosen, 0, 0) != 0:
    sys.exit(os.strerror(ctypes.get_errno()))
os.waitpid(chosen, WALL)  # it has stopped
os.waitpid(chosen, WALL)  # until it is killed: a tracer that ended would let it go, one that did not wait keep it
