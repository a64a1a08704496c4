# `make train` and `make test` set up whatever is missing first; what was set up once is not set up again.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
EXTRAS := render,perception,agent,orchestrator,experiments,bake,fitting,lifter,dev
CONFIG ?= configs/quickstart.toml

# Tests start hundreds of processes; without bytecode each would compile all of our modules, and pytest all tests anew.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help setup train test test-docker check check-aarch64 check-code check-tests benchmark doctor clean

help: ## show this list
	@grep -E '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-14s %s\n", $$1, $$2}'

setup: $(INSTALLED) ## virtual environment, system packages, pose network, bodies
	@$(BIN)/orchestrator models pull
	@$(BIN)/orchestrator bodies bake

$(INSTALLED): pyproject.toml constraints.txt install/system_packages.sh
	@sh install/system_packages.sh
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || \
		{ echo "Install Python 3.11 or newer with venv (Debian: apt-get install python3-venv)" >&2; exit 1; }
	@echo "Installing Python packages into $(VENV) (a few minutes the first time)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[$(EXTRAS)]'
	@touch $@

train: setup ## train on real renders and print the evaluation (CONFIG=configs/quickstart.toml)
	$(BIN)/orchestrator train $(CONFIG)

test: setup ## every test, real processes included
	@# The slow tests mostly wait for processes, so more of them run side by side than there are cores. A file's tests share
	@# their workers and stay together.
	$(BIN)/python -m pytest -m "not slow and not docker" --numprocesses auto --maxprocesses 2 --dist worksteal
	$(BIN)/python -m pytest -m "slow and not docker" --numprocesses 4 --dist loadfile --durations 10

test-docker: setup ## images, compose and containers on a real engine, if one can be had
	$(BIN)/python -m pytest -m docker -rs tests/docker

check-aarch64: $(INSTALLED) ## whether all that the perception image needs has a wheel for a Jetson
	$(BIN)/python docker/check_aarch64.py

check: $(INSTALLED) ## style, types, architecture and the quick tests, in under a minute
	@# Side by side: types are one thread's work, and tests wait for sockets and processes.
	@$(MAKE) --no-print-directory --jobs 2 check-code check-tests

check-code: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(BIN)/hadolint docker/Dockerfile

check-tests: $(INSTALLED)
	$(BIN)/python -m pytest -m "not slow" --hypothesis-profile few-examples --numprocesses 3 --dist worksteal

benchmark: setup ## each stage alone, and the loop
	$(BIN)/python -m benchmarks.loop

doctor: $(INSTALLED) ## what this machine has and lacks
	$(BIN)/orchestrator doctor

clean: ## remove what set-up and tests made here (the user's cache stays)
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis .import_linter_cache
