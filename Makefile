# Two commands for a new user: `make demo` and `make test`. Both set up .venv themselves; the second run is quick.
PYTHON ?= python3
BIN    := .venv/bin
READY  := .venv/.ready
RUNS   := .venv/.runs

.PHONY: setup demo prove test kernels campaign bench docs lint dist lock clean

setup: $(READY)

# What hil runs with: a quarter of the libraries that its tests need.
$(RUNS): run.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "hil needs Python 3.11 or newer, found " + sys.version.split()[0] + ": make PYTHON=/path/to/python3.11 ...")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r run.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

$(READY): requirements.lock $(RUNS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	touch $@

demo: $(RUNS)
	$(BIN)/hil demo

# Sealed cases, answered by the public command and opened: out/proof/scoreboard.html. Continues where it was interrupted.
prove: $(READY)
	$(BIN)/hil prove --out out/proof

test: $(READY)
	$(MAKE) --jobs 2 --output-sync lint kernels
	$(BIN)/python -m pytest -n 2 -m "not campaign"

# Compiled once, while lint has the other core; else each of pytest's workers would.
kernels: $(READY)
	$(BIN)/python -m tests.kernels

# What takes too long for every change: all figures of docs/reliability.md.
campaign: $(READY)
	$(BIN)/python -m pytest -n 2 -m campaign
	$(BIN)/python -m tests.campaigns.faults
	$(BIN)/python -m tests.campaigns.faults.middle
	$(BIN)/python -m tests.campaigns.faults.processes
	$(BIN)/python -m tests.campaigns.kills
	$(BIN)/python -m tests.campaigns.mutants
	$(BIN)/python -m tests.campaigns.fuzz
	$(BIN)/python -m tests.campaigns.day
	$(BIN)/python -m pytest tests/browser/test_foreign_text.py tests/plants tests/rig/test_sole_host.py
	$(BIN)/python -m tests.campaigns.fleet --out out/fleet

# Speed as ratios to scipy, a bare C loop, raw python-can; growth with the length, memory: docs/benchmarks.md.
bench: $(READY)
	$(BIN)/python -m tests.benchmarks.fit
	$(BIN)/python -m tests.benchmarks.diagnosis
	$(BIN)/python -m tests.benchmarks.fieldbus
	$(BIN)/python -m tests.benchmarks.recursive
	$(BIN)/python -m tests.benchmarks.fleet

# The manual as pages: out/docs/index.html.
docs: $(READY)
	$(BIN)/sphinx-build -q -W -b html docs out/docs

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python tools/words.py
	$(BIN)/python tools/layout.py
	$(BIN)/python tools/budget.py
	$(BIN)/lint-imports
	$(BIN)/mypy

# Wheel and sdist in dist/; each is tried in an environment where nothing else of this project is, with the declared ranges
# of its libraries and not the lock. Both must name the commit that they were built from.
dist: $(READY)
	rm -rf dist out/dist
	$(BIN)/python -m hatchling build
	$(PYTHON) -m venv out/dist
	for built in dist/*.whl dist/*.tar.gz; do \
	    out/dist/bin/python -m pip install --quiet --disable-pip-version-check $$built && \
	    tools/trial.sh $$built out/dist && \
	    out/dist/bin/python -m pip uninstall --quiet --yes hil-driveline || exit 1; \
	done

lock:   # needs `pip install uv`; writes names, versions and hashes only
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-emit-find-links \
	    --no-header --no-annotate --group dev --group docs pyproject.toml -o requirements.lock
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-emit-find-links \
	    --no-header --no-annotate --constraints requirements.lock --group install pyproject.toml -o run.lock
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-emit-find-links \
	    --no-header --no-annotate --group audit -o .ci/audit.lock

clean:
	rm -rf .venv out
