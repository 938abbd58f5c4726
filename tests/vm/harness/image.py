"""The test machine's disk: Debian with systemd, can-utils and Python, built once from Debian packages and kept."""

import fcntl
import hashlib
import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

GUEST: Final = Path(__file__).parents[1] / "guest"
XSTATE: Final = Path(__file__).with_name("xstate.c")
SUITE: Final = "bookworm"
DISK_MB: Final = 3000  # sparse
UML_MODULES: Final = Path("/usr/lib/uml/modules")

# What a box in a vehicle has; the libraries are what springscale's own package depends on.
PACKAGES: Final = (
    "systemd", "systemd-sysv", "udev", "dbus", "kmod", "iproute2", "can-utils", "procps", "python3", "libstdc++6",
    "dmsetup",
)  # fmt: skip
QEMU_PACKAGES: Final = ("linux-image-amd64", "initramfs-tools")  # the cloud kernel has no CAN
TOOLS: Final = ("mmdebstrap", "mke2fs", "depmod", "cc")
LEFT_OUT: Final = ("man", "doc", "locale", "info")  # below /usr/share

# Nothing of a test machine needs these, and each costs time at every boot.
MASKED: Final = (
    "apt-daily.timer", "apt-daily-upgrade.timer", "dpkg-db-backup.timer", "e2scrub_all.timer", "e2scrub_reap.service",
    "fstrim.timer", "getty@tty1.service", "console-getty.service", "serial-getty@ttyS0.service",
    "systemd-hwdb-update.service", "systemd-pstore.service", "systemd-update-utmp.service", "systemd-timesyncd.service",
)  # fmt: skip


def kept_image(backend: str) -> Path:
    """Folder with root.img (and vmlinuz, initrd.img for qemu), built now unless it is there already. Wants root."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "springscale"
    folder = cache / f"vm-{backend}-{_recipe(backend)}"
    cache.mkdir(parents=True, exist_ok=True)
    with (cache / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # of several workers one builds, the others wait
        if not (folder / "root.img").exists():
            for older in cache.glob(f"vm-{backend}-*"):
                shutil.rmtree(older)
            folder.mkdir()
            _build(folder, backend)
    return folder


def _recipe(backend: str) -> str:
    """Changes whenever the image would."""
    contents = b"".join(
        part.read_bytes() for part in (Path(__file__), XSTATE, GUEST / "agent.py", GUEST / "agent.service")
    )
    kernels = " ".join(sorted(kernel.name for kernel in UML_MODULES.glob("*"))) if backend == "uml" else ""
    return hashlib.sha256(contents + kernels.encode()).hexdigest()[:12]


def _build(folder: Path, backend: str) -> None:
    with TemporaryDirectory(dir=folder) as work:
        root = Path(work) / "root"
        _bootstrap(root, PACKAGES + (QEMU_PACKAGES if backend == "qemu" else ()))
        if backend == "uml":
            _add_modules(root)
            _run("cc", "-shared", "-fPIC", "-O1", "-o", str(folder / "xstate.so"), str(XSTATE))
        else:
            for name in ("vmlinuz", "initrd.img"):
                shutil.copyfile(next((root / "boot").glob(f"{name}-*")), folder / name)
        _settle(root)
        fresh = folder / "root.img.part"
        _run("mke2fs", "-q", "-t", "ext4", "-d", str(root), str(fresh), f"{DISK_MB}M")
        fresh.rename(folder / "root.img")


def _bootstrap(root: Path, packages: tuple[str, ...]) -> None:
    sources = Path("/etc/apt/sources.list.d/debian.sources")  # the host's own mirrors
    _run(
        "mmdebstrap", "--quiet", "--mode=root", "--variant=essential", '--aptopt=Apt::Install-Recommends "false"',
        *(f"--dpkgopt=path-exclude=/usr/share/{name}/*" for name in LEFT_OUT),
        f"--include={','.join(packages)}", SUITE, str(root),
        str(sources if sources.exists() else "/etc/apt/sources.list"),
    )  # fmt: skip


def _add_modules(root: Path) -> None:
    for kernel in UML_MODULES.iterdir():
        shutil.copytree(kernel, root / "usr/lib/modules" / kernel.name)
        _run("depmod", "-b", str(root), kernel.name)


def _settle(root: Path) -> None:
    """Name, agent, and nothing that waits for what is not there."""
    (root / "etc/hostname").write_text("springscale-test\n")
    (root / "etc/machine-id").write_text("")
    (root / "etc/fstab").write_text("")
    (root / "etc/systemd/journald.conf.d").mkdir(exist_ok=True)
    (root / "etc/systemd/journald.conf.d/test.conf").write_text("[Journal]\nStorage=volatile\nRuntimeMaxUse=64M\n")
    # No power cut comes before the tests have called sync; without this dpkg would, after every file.
    (root / "etc/dpkg/dpkg.cfg.d/test").write_text("force-unsafe-io\n")
    shutil.copyfile(GUEST / "agent.py", root / "usr/local/sbin/agent")
    shutil.copyfile(GUEST / "agent.service", root / "etc/systemd/system/agent.service")
    for unit in MASKED:
        (root / "etc/systemd/system" / unit).symlink_to("/dev/null")
    for folder in ("var/lib/apt/lists", "var/cache"):
        shutil.rmtree(root / folder)
        (root / folder).mkdir()
    _run("systemctl", f"--root={root}", "--quiet", "enable", "systemd-networkd.service", "agent.service")


def _run(*command: str) -> None:
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}")
