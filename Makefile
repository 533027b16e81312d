# Everything happens in one virtual environment, .venv, made here. Needs Python 3.11 or newer, git, and pip's index.
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3 python; do \
	command -v $$p >/dev/null 2>&1 && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin

.PHONY: demo test quick lint kernels robustness docs clean

# Workers of pytest; 0 runs all tests in one process.
WORKERS ?= 2
PYTEST = $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist loadgroup --no-loadscope-reorder

demo: .venv/.ready
	$(BIN)/depthtrack demo -o out/demo
	@echo "All commands: $(BIN)/depthtrack --help"

# One core compiles the kernels while the other one checks the sources.
test: .venv/.ready-test
	$(MAKE) --no-print-directory -j2 kernels lint
	$(PYTEST)

quick: .venv/.ready-test
	$(MAKE) --no-print-directory -j2 kernels lint
	$(PYTEST) -m "not slow"

kernels: .venv/.ready-test
	$(BIN)/depthtrack warmup

lint: .venv/.ready-test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# The long forms of the campaigns in tests/robustness: hours, at low priority.
robustness: .venv/.ready-test
	nice -n 19 $(BIN)/python -m tests.robustness.campaign --inputs 2000
	nice -n 19 $(BIN)/python -m tests.robustness.failing_writes
	nice -n 19 $(BIN)/python -m tests.robustness.option_matrix
	nice -n 19 $(BIN)/python -m tests.robustness.flat_resources
	nice -n 19 $(BIN)/python -m tests.robustness.flat_resources --frames 1 --opened 0 --tracker ik --seconds 3600

# Broken links and references between pages are errors. With --quiet, mkdocs would not count them.
docs: .venv/.ready-docs
	$(BIN)/python tools/generate_parameters.py
	$(BIN)/mkdocs build
	@echo "pages: out/docs/index.html"

clean:
	rm -rf .venv build dist out

.venv/bin/python:
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed: install it, or name it with  make PYTHON=/path/to/python" >&2; exit 1; }
	$(PYTHON) -m venv .venv

.venv/.ready: pyproject.toml | .venv/bin/python
	@echo "installing into .venv: the first time, this downloads about 200 MB"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/.ready-test: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,gltf,embree,sweep]'
	@touch $@

.venv/.ready-docs: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@
