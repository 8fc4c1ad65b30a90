# make demo   sets everything up in .venv and drives the screw; the run lies in runs/demo
# make test   sets everything up in .venv and runs the suite
# make check  what a change has to pass: ruff, mypy, the suite
# make lock   resolves the dependencies anew
# make clean  removes what the others made, runs/ excepted

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?= $(shell for python in python3 python3.13 python3.12 python3.11 python3.14; do \
	$$python -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 \
	&& echo $$python && break; done)
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
JOBS ?= 2
LOCKED := --generate-hashes --universal --python-version 3.11 --no-header --no-annotate --no-emit-index-url --quiet

.PHONY: demo test check lock clean

demo: $(VENV)/.run-ready
	@if $(BIN)/python -m turnscrew.show.gl; then $(BIN)/turnscrew fasten --out runs/demo --video; \
	else $(BIN)/turnscrew fasten --out runs/demo; fi

test: $(VENV)/.test-ready
	$(BIN)/python -m pytest -n $(JOBS)

check: $(VENV)/.test-ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -n $(JOBS)

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "turnscrew needs Python 3.11 or newer with venv (on Debian: apt-get install python3 python3-venv)"; exit 1; }
	@echo "making $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.run-ready: requirements.lock pyproject.toml | $(BIN)/python
	@echo "installing pinned dependencies"
	@$(PIP) install --require-hashes -r requirements.lock
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.test-ready: requirements-dev.lock $(VENV)/.run-ready
	@echo "installing what the suite needs"
	@$(PIP) install --require-hashes -r requirements-dev.lock
	@touch $@

lock: $(VENV)/.test-ready
	$(PIP) install uv
	$(BIN)/uv pip compile $(LOCKED) --extra video --extra vision --extra plots --extra build pyproject.toml -o requirements.lock
	$(BIN)/uv pip compile $(LOCKED) --extra video --extra vision --extra plots --extra build --extra dev -c requirements.lock pyproject.toml -o requirements-dev.lock
	@! grep -nE '://' requirements.lock requirements-dev.lock

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks
