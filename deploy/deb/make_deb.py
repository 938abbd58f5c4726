"""Builds the Debian packages from the locked requirements, without root: `make deb`.

springscale            what a vehicle needs: the service, its tools, estimators and calibration
springscale-workbench  what only a desk needs: simulator, demo, reproduction, reports (numba, matplotlib)

Both hold one relocatable tree, /usr/lib/springscale, with every dependency at its locked version: nothing of the
system's Python packages is used. Wheels are chosen for Debian 12 on the architecture asked for, and all else is the
same on every processor, so any machine builds the package of any other.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from importlib.metadata import Distribution, distributions
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from documents import document, normal_name, write_gzipped
from machine_code import PROCESSORS, require_own_code, wheel_options

HERE: Final = Path(__file__).resolve().parent
PROJECT: Final = HERE.parents[1]
DEPLOY: Final = PROJECT / "deploy"
TREE: Final = Path("usr/lib/springscale")
PYTHON: Final = f"python{sys.version_info.major}.{sys.version_info.minor}"

VEHICLE_LOCK: Final = PROJECT / "requirements.txt"
DESK_LOCK: Final = PROJECT / "requirements-workbench.txt"  # all of the vehicle's, and more
UNIMPORTED: Final = frozenset(("narwhals", "plotly"))  # in the vehicle's lock, but nobody imports them ...
STAYING: Final = ("plotly/package_data/plotly.min.js", "plotly-*.dist-info/*")  # ... the dashboard shows this one file
PINNED: Final = re.compile(r"^([a-z0-9][a-z0-9._-]*)==", re.MULTILINE)
SOURCES: Final = ("gateway", "dbc", "pyproject.toml", "README.md", "LICENSE")

# (source below the project, target in the package)
FILES: Final = (
    ("deploy/springscale.service", "lib/systemd/system/springscale.service"),
    ("deploy/springscale.sysusers", "usr/lib/sysusers.d/springscale.conf"),
    ("deploy/springscale.tmpfiles", "usr/lib/tmpfiles.d/springscale.conf"),
    ("deploy/springscale.sysctl", "usr/lib/sysctl.d/60-springscale.conf"),
    ("deploy/springscale.toml", "etc/springscale/springscale.toml"),
    ("deploy/network", "usr/share/springscale/network"),
    ("deploy/Caddyfile", "usr/share/springscale/Caddyfile"),
    ("deploy/prometheus", "usr/share/springscale/prometheus"),
    ("CHANGELOG.md", "usr/share/doc/springscale/CHANGELOG.md"),
)

LAUNCHER: Final = f"""\
#!/usr/bin/{PYTHON} -IS
# Isolated (-I) and without the system's packages (-S): the tree below is complete.
import sys

sys.path.insert(0, "/{TREE}")
from gateway.cli import main

main()
"""

CONTROL: Final = """\
Package: {name}
Version: {version}
Architecture: {architecture}
Maintainer: The Springscale founders <maintainers@springscale.invalid>
Installed-Size: {size_kib}
Depends: {depends}
{further}Section: misc
Priority: optional
Description: {summary}
"""

VEHICLE: Final = {
    "depends": f"{PYTHON}, libc6, libstdc++6, systemd",
    "further": "Recommends: can-utils, iproute2\nSuggests: springscale-workbench\n",
    "summary": """weighs a vehicle by listening to its springs
 Reads vertical acceleration, pitch rate and speed from a CAN bus and gives the
 payload and the front axle's share, each with its 95 % interval, over HTTP.
 Listens only. A systemd service with its tools.""",
}
DESK: Final = {
    "depends": "springscale (= {version})",
    "further": "",
    "summary": """simulator, demonstration and figures of Springscale
 What a desk needs and a vehicle does not: the commands demo, simulate and
 reproduce, and figures in reports.""",
}


def main() -> None:
    """Both packages into the output folder; prints their names and sizes."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--output", type=Path, default=PROJECT / "build")
    arguments.add_argument("--architecture", choices=PROCESSORS, help="by default this machine's")
    asked = arguments.parse_args()
    output: Path = asked.output
    architecture = asked.architecture or subprocess.check_output(["dpkg", "--print-architecture"], text=True).strip()
    output.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("SOURCE_DATE_EPOCH", last_change_s())
    with TemporaryDirectory(dir=output, prefix="deb-") as folder:
        vehicle, desk = Path(folder) / "springscale", Path(folder) / "springscale-workbench"
        install(vehicle / TREE, architecture)
        part(vehicle / TREE, desk / TREE)
        furnish(vehicle)
        for root, fields in ((vehicle, VEHICLE), (desk, DESK)):
            require_own_code(root / TREE, architecture)
            compile_all(root)
            document(root, root / TREE, version())
            package = pack(root, fields, architecture, output)
            print(f"{package}: {package.stat().st_size / 1e6:.0f} MB, {installed_kib(root) / 1e3:.0f} MB installed")


def last_change_s() -> str:
    """When the sources changed last (seconds), so that the same sources give the same package."""
    command = ["git", "log", "-1", "--format=%ct"]  # fails where the sources are no checkout
    asked = subprocess.run(command, cwd=PROJECT, capture_output=True, text=True, check=False)
    return asked.stdout.strip() or str(int((PROJECT / "pyproject.toml").stat().st_mtime))


def install(tree: Path, architecture: str) -> None:
    """The locked requirements and the package itself into ``tree``."""
    pip = [sys.executable, "-m", "pip", "install", "-qq", "--no-compile", "--no-deps", "--target", str(tree)]
    pip.append("--disable-pip-version-check")
    locked = ["--require-hashes", "-r", str(DESK_LOCK)]
    subprocess.run([*pip, *wheel_options(architecture), *locked], check=True)
    with TemporaryDirectory() as folder:  # setuptools leaves its traces beside what it builds
        for name in SOURCES:
            copy(PROJECT / name, Path(folder) / name)
        subprocess.run([*pip, "--no-build-isolation", "--upgrade", folder], check=True)
    for leftover in ("bin", "share"):  # launchers of libraries, manual pages
        shutil.rmtree(tree / leftover, ignore_errors=True)
    for tests in [folder for folder in tree.rglob("tests") if folder.is_dir()]:  # the libraries' own: nobody runs them
        shutil.rmtree(tests, ignore_errors=True)  # some lie within others
    for library in tree.rglob("*.so*"):
        library.chmod(0o644)


def part(tree: Path, desk: Path) -> None:
    """Move what only the workbench needs from one tree to the other, and remove what nobody imports."""
    names = of_desk()
    for found in distributions(path=[str(tree)]):
        if normal_name(found) in names:
            move(found, tree, desk)
        elif normal_name(found) in UNIMPORTED:
            move(found, tree, None)


def of_desk() -> frozenset[str]:
    """Names of the distributions that a vehicle does without."""
    return pinned(DESK_LOCK) - pinned(VEHICLE_LOCK)


def pinned(lock: Path) -> frozenset[str]:
    """Names of the distributions in a lock file."""
    return frozenset(PINNED.findall(lock.read_text()))


def move(found: Distribution, tree: Path, desk: Path | None) -> None:
    """The files of one distribution, wherever it recorded them, but for those that stay; None: nowhere."""
    for file in found.files or ():
        source = tree / file
        if any(fnmatch(str(file), pattern) for pattern in STAYING):
            continue
        if source.is_file() and tree in source.resolve().parents:
            if desk is None:
                source.unlink()
            else:
                (desk / file).parent.mkdir(parents=True, exist_ok=True)
                source.rename(desk / file)
            remove_empty(source.parent, tree)


def remove_empty(folder: Path, tree: Path) -> None:
    """This folder and those above it, as far as they are empty."""
    while folder != tree and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


def compile_all(root: Path) -> None:
    """Byte code made now, never checked again: the first start is as quick as the hundredth, on read-only disks too."""
    options = ["-q", "-j", "0", "--invalidation-mode", "unchecked-hash", "-s", str(root), "-p", "/"]
    subprocess.run([sys.executable, "-m", "compileall", *options, str(root / TREE)], check=True)


def furnish(root: Path) -> None:
    """Launcher, unit, configuration, documents."""
    for source, target in FILES:
        copy(PROJECT / source, root / target)
    launcher = root / "usr/bin/springscale"
    launcher.parent.mkdir(parents=True)
    launcher.write_text(LAUNCHER)
    launcher.chmod(0o755)
    for page in sorted((PROJECT / "docs").glob("*.md")):
        copy(page, root / "usr/share/doc/springscale" / page.name)
    write_gzipped(root / "usr/share/man/man1/springscale.1.gz", (HERE / "springscale.1").read_text())


def version() -> str:
    """Of the project."""
    return str(tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]["version"])


def pack(root: Path, fields: dict[str, str], architecture: str, output: Path) -> Path:
    """The .deb of one tree; scripts and conffiles belong to the vehicle's package alone."""
    filled = {key: text.format(version=version()) if "{version}" in text else text for key, text in fields.items()}
    control = CONTROL.format(
        name=root.name, version=version(), architecture=architecture, size_kib=installed_kib(root), **filled
    )
    (root / "DEBIAN").mkdir()
    (root / "DEBIAN/control").write_text(control)
    if root.name == "springscale":
        (root / "DEBIAN/conffiles").write_text("/etc/springscale/springscale.toml\n")
        for script in ("postinst", "prerm", "postrm"):
            copy(HERE / script, root / "DEBIAN" / script)
            (root / "DEBIAN" / script).chmod(0o755)
    package = output / f"{root.name}_{version()}_{architecture}.deb"
    subprocess.run(
        ["dpkg-deb", "--root-owner-group", "-Zzstd", "-z12", "--build", str(root), str(package)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return package


def installed_kib(root: Path) -> int:
    """KiB of all files."""
    return sum(file.stat().st_size for file in root.rglob("*") if file.is_file()) // 1024


def copy(source: Path, target: Path) -> None:
    """A file or a folder, readable by everybody, without what running left in it."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
    else:
        shutil.copyfile(source, target)


if __name__ == "__main__":
    os.umask(0o022)
    main()
