# echobeam: `make demo` shows it, `make test` examines it; both need Python 3.11+ and make only.

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
JOBS   ?= 2

.PHONY: demo test quick bench compiled lint types rules docs clean

demo: $(VENV)/.demo
	$(BIN)/echobeam compile
	$(BIN)/echobeam run paper-multi --trials 200 --jobs $(JOBS) --out paper-multi.nc --force
	$(BIN)/echobeam plot paper-multi.nc

test: $(VENV)/.dev
	$(MAKE) --no-print-directory -j $(JOBS) compiled types lint rules
	$(BIN)/python -m pytest -n $(JOBS)

quick: compiled
	$(BIN)/python -m pytest -n $(JOBS) -m "not slow"

bench: $(VENV)/.dev
	$(BIN)/python -m pytest benchmarks --benchmark-only -p no:xdist

# Compiles the beam solver once, so that no test waits for the compiler and no two do it at once.
compiled: $(VENV)/.dev
	$(BIN)/echobeam compile --quiet

lint: $(VENV)/.dev
	$(BIN)/ruff format --check src tests benchmarks examples
	$(BIN)/ruff check src tests benchmarks examples

types: $(VENV)/.dev
	$(BIN)/mypy

rules: $(VENV)/.dev
	$(BIN)/lint-imports

docs: $(VENV)/.docs
	$(BIN)/mkdocs build --strict

clean:
	rm -rf $(VENV) site .mypy_cache .ruff_cache .pytest_cache

# The marks say what is installed; a changed pyproject.toml installs again.
$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "echobeam needs Python 3.11 or newer; this is `$(PYTHON) --version`. Try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/.dev: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[dev]"
	@touch $@ $(VENV)/.demo

$(VENV)/.docs: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[docs]"
	@touch $@
