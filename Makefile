# Every target does its own set-up: a machine with Python 3.11 (venv, pip) and make is enough.
# PYTHON=python3.12 make test builds with another interpreter, make demo PORT=8001 serves on another port.
PYTHON ?= python3
PORT := 8000
BIN := .venv/bin
PIP := $(BIN)/pip --disable-pip-version-check

.PHONY: demo test check audit bench deb dist fleet-test soak test-vm vm-image vcan lock docs site screenshots clean
.DEFAULT_GOAL := demo

.venv/bin/python:
	@echo "Setting up .venv, once; pip tells how far it is."
	$(PYTHON) -m venv .venv

# What builds the package is locked too: nothing is fetched without a hash.
.venv/.build: requirements-build.txt | .venv/bin/python
	$(PIP) install --require-hashes -r requirements-build.txt
	touch $@

# The package itself, with the workbench, is installed in place: the code is read from here, so only its metadata makes
# a new set-up.
.venv/.package: requirements-workbench.txt pyproject.toml .venv/.build
	$(PIP) install --require-hashes -r requirements-workbench.txt
	$(PIP) install --no-deps --no-build-isolation --editable .
	touch $@

.venv/.development: requirements-dev.txt .venv/.package
	$(PIP) install --require-hashes -r requirements-dev.txt
	touch $@

demo: .venv/.package
	$(BIN)/springscale demo --port $(PORT)

# A whole file stays on one worker: compiled code and servers are shared inside it. Small matrices: more threads only cost.
test: .venv/.development
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile

check: .venv/.development
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python docs/make.py --check
	$(BIN)/python docs/make_site.py
	$(AUDIT) 2>/dev/null || echo "A weakness is known, or $(OSV) could not be asked: make audit says which."

# Known weaknesses of the locked packages; fails where there is one, or where nobody can be asked. `make check` shows the
# same and does not fail: whoever works offline, or on the day of somebody else's advisory, can still check their change.
# A vehicle's packages are among a desk's.
OSV := https://api.osv.dev/v1/query
AUDIT = $(BIN)/python -m pip_audit --vulnerability-service=osv --osv-url=$(OSV) --disable-pip --require-hashes --strict \
	--progress-spinner=off --timeout=10 -r requirements-workbench.txt -r requirements-build.txt
audit: .venv/.development
	$(AUDIT)

# Everything about speed, beside others where these are installed (pip install --group bench), in one run and one table;
# writes docs/performance.json and its page. A quarter of an hour and ten gigabytes of disk.
bench: .venv/.development deb
	$(BIN)/python -m benchmarks.speed --output docs/performance.json
	$(BIN)/python docs/make.py docs/performance.md

# Fifty vehicles, or `make fleet-test VEHICLES=500`, into a broker and a database that are killed meanwhile; wants
# Debian's mosquitto and postgresql. Some minutes; writes docs/fleet_test.json and its place in docs/fleet.md.
VEHICLES := 50
fleet-test: .venv/.development
	rm -f build/fleet-test.json
	SPRINGSCALE_FLEET=$(VEHICLES) $(BIN)/python -m pytest tests/fleet
	test ! -e build/fleet-test.json || $(BIN)/python docs/make.py --counts build/fleet-test.json docs/fleet.md

# The installed package on a real vcan0 under real systemd, in a small virtual machine: wants root, /dev/net/tun and the
# Debian packages that .ci/run names; skips with a reason without them. One machine on each of two processors.
test-vm: .venv/.development deb
	rm -f build/vm-results.json
	$(BIN)/python -m pytest -n 2 --dist loadfile tests/vm

# What of test-vm needs no test: its machine's disk, built once and kept.
vm-image: .venv/.development
	PYTHONPATH=tests $(BIN)/python -c "from vm.harness.image import kept_image; kept_image('uml')"

# A simulated drive on this machine's own vcan0, into the service: docs/deployment.md.
vcan: .venv/.package
	PATH="$(CURDIR)/$(BIN):$$PATH" deploy/try-on-vcan.sh

# A simulated week in the service at high speed, some minutes of one processor; then, where `make test-vm` can run, 200
# kills of the service, 30 power cuts of its machine at random moments and 30 drives to learn from, three quarters of an
# hour.
SOAK_TESTS := tests/vm/test_4_process_faults.py::test_repeated_kills_lose_and_double_nothing \
	tests/vm/test_6_power.py tests/vm/test_7_learning.py
soak: .venv/.development deb
	$(BIN)/python -m benchmarks.speed.soak --output build/soak.json
	rm -f build/vm-soak.json
	SPRINGSCALE_VM_RESULTS=vm-soak.json SPRINGSCALE_KILLS=200 SPRINGSCALE_POWER_CUTS=30 SPRINGSCALE_DRIVES=30 \
		$(BIN)/python -m pytest -n 2 --dist loadfile $(SOAK_TESTS)

# Debian packages in build/, for this machine's architecture or another, such as `make deb ARCHITECTURE=arm64`; dpkg-deb
# must be there, root need not.
PACKAGED := $(shell find gateway dbc deploy docs -type f -not -name '*.pyc') \
	CHANGELOG.md LICENSE README.md pyproject.toml requirements.txt requirements-workbench.txt
PACKAGES := build/.packages$(addprefix -,$(ARCHITECTURE))
deb: $(PACKAGES)
$(PACKAGES): $(PACKAGED) | .venv/.package
	$(BIN)/python deploy/deb/make_deb.py $(addprefix --architecture ,$(ARCHITECTURE))
	touch $@

# Wheel, source archive and bills of materials of the last commit in dist/: the same bytes wherever they are made.
dist: .venv/.development
	$(BIN)/python deploy/dist/make_dist.py

# The pictures in README.md and docs; needs chromium.
screenshots: .venv/.development
	$(BIN)/python docs/make_screenshots.py

docs: .venv/.development
	$(BIN)/python docs/make_tutorial.py
	$(BIN)/python docs/make.py

# The documents as a site, in build/site.
site: .venv/.development
	$(BIN)/python docs/make_site.py

# For Linux and Python 3.11 and later; the lock names no package index, so it serves behind any mirror.
COMPILE = .venv-lock/bin/uv pip compile --quiet --python-platform linux --python-version 3.11 --generate-hashes \
	--no-annotate --custom-compile-command "make lock, for Python 3.11" --constraint deploy/dist/constraints.txt
GROUPS = import sys, tomllib; g = tomllib.load(open('pyproject.toml', 'rb'))['dependency-groups']; \
	print(*(each for name in sys.argv[1:] for each in g[name]), sep='\n')

# What a vehicle needs, what a desk needs besides, what builds the package, what a developer needs besides.

lock:
	$(PYTHON) -m venv .venv-lock
	.venv-lock/bin/pip install --quiet uv
	$(COMPILE) --output-file requirements.txt pyproject.toml
	$(COMPILE) --extra workbench --constraint requirements.txt --output-file requirements-workbench.txt pyproject.toml
	$(PYTHON) -c "$(GROUPS)" build | $(COMPILE) --constraint requirements-workbench.txt \
		--output-file requirements-build.txt -
	$(PYTHON) -c "$(GROUPS)" dev browser | $(COMPILE) --constraint requirements-workbench.txt \
		--constraint requirements-build.txt --output-file requirements-dev.txt -

clean:
	rm -rf .venv .venv-lock build dist
