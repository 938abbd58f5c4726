"""Runs inside the test machine: does what the tests ask for, one request a connection.

A request is one line of JSON, {"run": SHELL, "timeout_s": S} or {"write": PATH, "n_bytes": N} followed by the bytes;
the answer is {"code": C, "out": ..., "err": ...}. It listens on the network that only the tests' host shares.
"""

import json
import socketserver
import subprocess
from pathlib import Path

PORT = 9999


class Request(socketserver.StreamRequestHandler):
    def handle(self):
        line = self.rfile.readline()
        if not line:  # a probe
            return
        asked = json.loads(line)
        try:
            if "run" in asked:
                answer = run(asked["run"], asked["timeout_s"])
            else:
                answer = self.write(asked["write"], asked["n_bytes"])
        except OSError as failed:  # no such folder, no space
            answer = {"code": 1, "out": "", "err": str(failed)}
        self.wfile.write(json.dumps(answer).encode() + b"\n")

    def write(self, path, n_bytes):
        with Path(path).open("wb") as file:
            while n_bytes:
                piece = self.rfile.read(min(n_bytes, 1 << 20))
                if not piece:
                    return {"code": 1, "out": "", "err": "the file was cut short"}
                file.write(piece)
                n_bytes -= len(piece)
        return {"code": 0, "out": "", "err": ""}


def run(command, timeout_s):
    try:
        done = subprocess.run(
            ["/bin/bash", "-c", command], stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout_s, check=False
        )
    except subprocess.TimeoutExpired as late:
        return {"code": 124, "out": (late.stdout or b"").decode(errors="replace"), "err": f"not done in {timeout_s} s"}
    return {
        "code": done.returncode,
        "out": done.stdout.decode(errors="replace"),
        "err": done.stderr.decode(errors="replace"),
    }


class Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True


if __name__ == "__main__":
    Server(("0.0.0.0", PORT), Request).serve_forever()
