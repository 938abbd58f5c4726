"""Stops one thread of a process, and that one alone, for good: python3 freeze_thread.py PID THREAD_NAME."""

import ctypes
import os
import sys
import time
from pathlib import Path

PTRACE_ATTACH = 16

process, name = sys.argv[1:3]
threads = Path("/proc", process, "task").iterdir()
chosen = next(int(thread.name) for thread in threads if (thread / "comm").read_text().strip() == name)
libc = ctypes.CDLL(None, use_errno=True)
if libc.ptrace(PTRACE_ATTACH, chosen, 0, 0) != 0:
    sys.exit(os.strerror(ctypes.get_errno()))
while Path("/proc", process).exists():  # a tracer that ends would let it go
    time.sleep(0.1)
