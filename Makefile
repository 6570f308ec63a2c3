# Two commands for a stranger: `make demo` and `make test`. Both make their own .venv and work offline afterwards.
PYTHON ?= python3
BIN := .venv/bin
WORKERS ?= 2
# Extras with the packages of the adapters that `make test-adapters` installs.
ADAPTERS := ros,mavlink,quadrotor,irsim,commonroad,sumo
DRAWS ?= first
TABLE_DATA ?= data/peers
PYTEST := $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal
PROGRAMS := start sampling mpc stages decision walls scaling fleet_step boundaries memory
export PIP_CONSTRAINT := $(CURDIR)/constraints.txt
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Modules that no test imports need not be compiled to bytecode.
export PIP_NO_COMPILE := 1
# The bytecode of tests, with their rewritten assertions, is kept for later runs.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo docs tables test test-adapters test-all test-paper debug-test nightly kernels golden chromium ci lint bench
.PHONY: speed wheel release release-check clean

.venv/run.stamp: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else f"slalom needs Python 3.11 or later, found {sys.version.split()[0]}; try: make PYTHON=python3.12")'
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --editable '.[view]'
	@touch $@

.venv/test.stamp: .venv/run.stamp
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	@touch $@

.venv/bench.stamp: .venv/run.stamp
	$(BIN)/python -m pip install --quiet --editable '.[peers,bench]'
	@touch $@

# The documentation site, in out/site. Every warning is an error.
docs: .venv/test.stamp
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs out/site
	@echo "The site is out/site/index.html."

demo: .venv/run.stamp
	@mkdir -p out
	$(BIN)/slalom run recorded_roundabout --method nao --out out/recorded_roundabout.h5 --figure out/recorded_roundabout.png
	@echo
	@echo "The picture is out/recorded_roundabout.png, the recording out/recorded_roundabout.h5."

lint: .venv/test.stamp
	$(BIN)/ruff check src tests benchmarks examples tools
	$(BIN)/ruff format --check src tests benchmarks examples tools
	$(BIN)/mypy
	$(BIN)/lint-imports

# Kernels are compiled once, before the workers of the tests begin, which would each compile them. PYTHONPATH: the
# packages of the tests may be installed meanwhile, which takes slalom away for a moment.
kernels: .venv/run.stamp
	@PYTHONPATH=src $(BIN)/python -m slalom compile

# The first draws of every law. DRAWS=commit adds slow tests and the eighth of the other draws that is this commit's turn.
test: .venv/run.stamp
	@$(MAKE) --no-print-directory -j2 lint kernels
	$(PYTEST) -m "not paper and not adapters" --draws $(DRAWS)

test-all: lint kernels
	$(PYTEST) --draws all

# Kernels compiled and as Python: equal bits, and which of their lines ran.
debug-test: .venv/test.stamp kernels
	$(BIN)/python tools/debug_test.py

# Work of long scenes; kernels as Python, compiled anew and exported; golden runs with an index checked at each access;
# one hour of decisions in each chain of the tests of contact.
nightly: .venv/test.stamp kernels
	$(BIN)/python tools/counts.py --all
	$(BIN)/python -m slalom compile --export out/compiled
	$(BIN)/python tools/debug_test.py --each 1 --steps 10 --entries out/compiled
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(CURDIR)/out/bounds $(BIN)/python tools/golden.py
	SLALOM_STEPS=36000 $(PYTEST) --draws all tests/decision/test_kept_clearance.py

# Adapters whose packages are extras that dev leaves out.
test-adapters: kernels
	$(BIN)/python -m pip install --quiet --editable '.[dev,$(ADAPTERS)]'
	$(PYTEST) -m adapters

test-paper: kernels
	$(PYTEST) -m paper

# Chromium opens the pages in the tests of the view. Where it cannot be installed, these tests are skipped.
chromium:
	@command -v chromium >/dev/null || { apt-get update -qq && apt-get install -y -qq chromium >/dev/null; } \
		|| echo "Chromium cannot be installed here: the tests of the view in a browser are skipped."
	@command -v npm >/dev/null && (cd web && npm ci --silent) \
		|| echo "Node is not installed: the bundle of the view is not built again."

# Builds sdist and wheel in out/dist, lists them, and installs them into clean environments of every Python there is.
release-check: .venv/test.stamp
	PIP_CONSTRAINT= $(BIN)/python tools/release_check.py

# A wheel for this Python, platform and numba that holds the compiled kernels: nothing compiles where it is installed.
# Kernels that this checkout has compiled from equal sources are not compiled again.
wheel: .venv/test.stamp
	rm -rf out/compiled out/dist/slalom-*-none-[!a]*.whl
	$(BIN)/python -m slalom compile --export out/compiled
	SLALOM_WHEEL_ENTRIES=$(CURDIR)/out/compiled $(BIN)/python -m build --wheel --no-isolation --outdir out/dist
	PIP_CONSTRAINT= $(BIN)/python tools/release_check.py --compiled out/dist/slalom-*-none-[!a]*.whl

release:
	$(MAKE) --no-print-directory release-check
	$(MAKE) --no-print-directory wheel

# What continuous integration runs.
ci: demo kernels golden chromium
	$(MAKE) test DRAWS=commit
	$(MAKE) test-paper

# Digests of runs, choices and boundaries, compared with those of tools/golden.json: a change of form changes none.
golden: .venv/test.stamp
	$(BIN)/python tools/golden.py

# Every table that tools/tables.py writes, in one go. TABLE_DATA is the folder with the test cases of other projects.
tables: .venv/bench.stamp kernels
	$(BIN)/python tools/tables.py --make roundabout_crossing --make fleets --make planners --make crowdnav --data $(TABLE_DATA) --jobs 2

# One decision runs on one thread, and so must the matrix products that it is compared with.
bench: export OPENBLAS_NUM_THREADS := 1
bench: .venv/bench.stamp
	@for program in $(PROGRAMS); do echo; echo "== $$program"; $(BIN)/python benchmarks/$$program.py || exit 1; done
	$(BIN)/python benchmarks/report.py --keep benchmarks/results/performance

# Times of this state over those of the commit BASE, by turns, beside the noise.
speed: .venv/bench.stamp
	$(BIN)/python tools/speed.py $(BASE)

clean:
	rm -rf .venv out .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache
