"""Ways to run the test machine: User Mode Linux, or QEMU. Both need root, /dev/net/tun and the tools named here."""

import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vm.harness.image import TOOLS

UML: Final = "linux.uml"
QEMU: Final = "qemu-system-x86_64"
MEMORY_MB: Final = 1024


@dataclass(frozen=True, slots=True)
class Wiring:
    """The parts of a start: the kept image, this run's own disk, its network."""

    image: Path
    disk: Path
    further_disks: tuple[Path, Path]
    tap: str
    guest_address: str  # with its prefix length


@dataclass(frozen=True, slots=True)
class Backend:
    """How to run the machine in the foreground, its console on standard output, and what it calls its further disks."""

    name: str
    command: Callable[[Wiring], list[str]]
    further_disks: tuple[str, str]


def best_backend() -> Backend | str:
    """User Mode Linux before QEMU; SPRINGSCALE_VM names one. Where none can run: why, in one line."""
    missing = [tool for tool in (*TOOLS, "ip", "setpriv", "unshare", "taskset") if shutil.which(tool) is None]
    if os.geteuid() != 0:
        return "a test machine needs root"
    if not os.access("/dev/net/tun", os.R_OK | os.W_OK):
        return "a test machine needs /dev/net/tun"
    if missing:
        return f"a test machine needs {', '.join(missing)}: see the packages in .ci/run"
    present = [name for name, (program, _) in _BACKENDS.items() if shutil.which(program)]
    wanted = os.environ.get("SPRINGSCALE_VM", present[0] if present else "")
    if wanted not in present:
        return f"a test machine needs {UML} (package user-mode-linux) or {QEMU} (package qemu-system-x86)"
    return _BACKENDS[wanted][1]


def _uml(wiring: Wiring) -> list[str]:
    # One CPU: User Mode Linux switches between its kernel and its user process at every system call, and across
    # CPUs that costs many times more.
    return ["taskset", "--cpu-list", str(_own_processor()),
            "env", f"LD_PRELOAD={wiring.image / 'xstate.so'}", UML, "seccomp=on", f"mem={MEMORY_MB}M",
            *(f"ubd{i}={disk}" for i, disk in enumerate((wiring.disk, *wiring.further_disks))),
            "root=/dev/ubda", "rw", "rootfstype=ext4",
            f"vec0:transport=tap,ifname={wiring.tap},depth=64,gro=1", "con0=null,fd:1", "con=null",
            *_common("vec0", wiring)]  # fmt: skip


def _own_processor() -> int:
    """Another one for each of pytest's workers, the last first."""
    processors = sorted(os.sched_getaffinity(0), reverse=True)
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    return processors[worker % len(processors)]


def _qemu(wiring: Wiring) -> list[str]:
    # kvm_pvm runs patched guests only: /dev/kvm counts where a processor's own module stands behind it.
    has_kvm = any(Path("/sys/module", module).exists() for module in ("kvm_amd", "kvm_intel"))
    accelerator = ["-accel", "kvm", "-cpu", "host"] if has_kvm else ["-accel", "tcg,thread=multi", "-cpu", "max"]
    return [QEMU, *accelerator, "-smp", "2", "-m", str(MEMORY_MB), "-display", "none", "-nodefaults", "-no-reboot",
            "-serial", "stdio", "-kernel", str(wiring.image / "vmlinuz"), "-initrd", str(wiring.image / "initrd.img"),
            *(part for disk in (wiring.disk, *wiring.further_disks)
              for part in ("-drive", f"file={disk},if=virtio,format=raw,cache=writeback")),
            "-netdev", f"tap,id=net,ifname={wiring.tap},script=no,downscript=no",
            "-device", "virtio-net-pci,netdev=net,romfile=", "-device", "virtio-rng-pci",
            "-append", " ".join(["root=/dev/vda rw console=ttyS0 net.ifnames=0 panic=-1", *_common("eth0", wiring)])
            ]  # fmt: skip


def _common(interface: str, wiring: Wiring) -> list[str]:
    return ["quiet", "systemd.show_status=0", f"springscale.network={interface},{wiring.guest_address}"]


_BACKENDS: Final[Mapping[str, tuple[str, Backend]]] = {
    "uml": (UML, Backend("uml", _uml, ("/dev/ubdb", "/dev/ubdc"))),
    "qemu": (QEMU, Backend("qemu", _qemu, ("/dev/vdb", "/dev/vdc"))),
}
