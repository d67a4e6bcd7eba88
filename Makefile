# Every target sets up .venv from the lock files by itself. Needs: make, Python 3.11 to 3.13.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
SCENE  ?= living-room
ARGS   ?=

# Where no bytecode is kept, every process compiles all that it imports: two seconds each.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test test-fast mutants check docs audit bench reproduce results results-record lock scenes recordings clean

run: $(VENV)/.core  ## the app in the browser, with a scene reconstructed
	$(BIN)/packetmesh serve --scene $(SCENE) --open $(ARGS)

test: $(VENV)/.dev  ## all tests, in parallel
	$(BIN)/python -m pytest -n 3 --dist loadgroup --no-loadscope-reorder $(ARGS)

test-fast: $(VENV)/.dev  ## the quick tests, without a browser
	$(BIN)/python -m pytest -n 3 --dist loadgroup --no-loadscope-reorder -m "not browser and not slow" $(ARGS)

mutants: $(VENV)/.dev  ## plant faults one at a time; docs/mutants.md says which no test sees
	$(BIN)/python -m lab.mutants $(ARGS)

check: $(VENV)/.dev docs  ## style, types, import rules, documentation
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/.dev  ## the documentation site, in runs/site; a dead link is an error
	$(BIN)/python -m sphinx -W --keep-going -q -E -b html docs runs/site

audit: $(VENV)/.uv  ## the pinned packages beside the known vulnerabilities; fails if one cannot be looked up
	$(BIN)/uv run -q --no-project --isolated --with-requirements requirements-audit.lock \
	  pip-audit --strict --disable-pip --require-hashes -r requirements.lock

bench: $(VENV)/.dev  ## speed and memory, beside peers
	$(BIN)/packetmesh bench --out runs/bench $(ARGS)

reproduce: $(VENV)/.core  ## the thesis's claims beside ours
	$(BIN)/packetmesh reproduce --out runs/reproduce $(ARGS)

results: $(VENV)/.core  ## docs/results.md and the README's results, from the records in docs/results
	$(BIN)/python -m lab.results write

results-record: $(VENV)/.dev  ## measure for the records named by ONLY, then as above
	$(BIN)/python -m lab.results record $(ONLY)

scenes: $(VENV)/.core  ## render the demo scenes again
	$(BIN)/python -m lab.worlds $(ARGS)

recordings: $(VENV)/.core  ## render the demo recording again
	$(BIN)/python -m lab.walks.shipped

lock: $(VENV)/.uv  ## pin everything anew
	$(BIN)/uv pip compile -q --universal --generate-hashes --no-header --python-version 3.11 pyproject.toml -o requirements.lock
	$(BIN)/uv pip compile -q --universal --generate-hashes --no-header --python-version 3.11 pyproject.toml --group dev -o requirements-dev.lock
	$(BIN)/uv pip compile -q --universal --generate-hashes --no-header --python-version 3.11 --group audit -o requirements-audit.lock
	$(BIN)/uv pip compile -q --universal --generate-hashes --no-header --python-version 3.11 pyproject.toml --extra train -o requirements-train.lock

clean:
	rm -rf $(VENV)

$(VENV)/.uv: requirements-uv.lock
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' || \
	  { echo "PacketMesh needs Python 3.11 to 3.13, and '$(PYTHON)' is another: try make PYTHON=python3.12 ..." >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements-uv.lock
	@touch $@

$(VENV)/.installed: $(VENV)/.uv requirements.lock pyproject.toml
	$(BIN)/uv pip install -q --python $(BIN)/python --require-hashes -r requirements.lock
	$(BIN)/uv pip install -q --python $(BIN)/python --no-deps --no-build-isolation -e .
	@touch $@

# Numba notices when the file of a function changes, but not when a file does whose functions it calls.
$(VENV)/.core: $(VENV)/.installed $(shell grep -rlE 'njit|compiled' --include='*.py' pipeline lab)
	find pipeline lab -name '*.nb[ic]' -delete
	$(BIN)/python -m app.compute.warm  # compiles; not at the first use
	$(BIN)/python -m app.compute.prepared  # what a new server shows first
	@touch $@

$(VENV)/.dev: $(VENV)/.core requirements-dev.lock
	$(BIN)/uv pip install -q --python $(BIN)/python --require-hashes -r requirements-dev.lock
	$(BIN)/python -m app.compute.prepared  # again: what it keeps depends on the installed packages
	@touch $@
