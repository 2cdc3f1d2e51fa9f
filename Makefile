# make run: simulate the seed drive.  make test: check everything.  Both set up .venv when it is missing or outdated.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/installed
WORKERS ?= 2

.DEFAULT_GOAL := help
.PHONY: help run test test-fast test-studies check checked compiled setup lock schema picture site blind pythons clean

help:
	@echo "make run           simulate the seed drive; the log and the picture go to logs/"
	@echo "make test          lint, types and the tests"
	@echo "make test-fast     the same without the slow ones"
	@echo "make test-studies  slow tests on further cases: what make test has no time for"
	@echo "make setup         only install what is needed into $(VENV)"
	@echo "make lock          resolve the development set anew (needs uv)"
	@echo "make schema        write the JSON schemas of what people write anew"
	@echo "make site          build the documentation into build/site, its gallery run, a warning being an error"
	@echo "make pythons       install the wheel in every Python from 3.11 to 3.14 that there is, and run a user's tasks there"
	@echo "make blind         hide effects in data and see what the diagnosis makes of them (hours; goes on where it stopped)"
	@echo "make picture       draw docs/images/seed_move.png and the pages' pictures anew (some need Chromium)"
	@echo "make clean         remove $(VENV), caches and logs"

setup: $(STAMP)

$(STAMP): pyproject.toml requirements-dev.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "hdsim needs Python 3.11 or newer; found: $$($(PYTHON) --version 2>&1). Try: make PYTHON=python3.12"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@# What is imported is compiled then; most of what is installed never is.
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -r requirements-dev.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

run: $(STAMP)
	$(BIN)/hdsim run scenarios/seed_move.yaml

check: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Types take one core, compilation the other; processes side by side would each compile.
checked: $(STAMP)
	@$(MAKE) --no-print-directory -j2 check compiled

compiled: $(STAMP)
	$(BIN)/python tests/compiled.py

test: checked
	$(BIN)/pytest -n $(WORKERS) --dist worksteal --durations=10 -m "not study"

test-fast: checked
	$(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not slow and not study"

test-studies: checked
	$(BIN)/pytest -n $(WORKERS) --dist worksteal --durations=10 -m study

lock:
	uv pip compile --quiet --universal --python-version 3.11 --group dev --all-extras \
	  --no-header --output-file requirements-dev.lock pyproject.toml

schema: $(STAMP)
	$(BIN)/hdsim schema -o scenarios/scenario.schema.json
	$(BIN)/hdsim schema mapping -o scenarios/mappings/mapping.schema.json
	$(BIN)/hdsim schema study -o scenarios/studies/study.schema.json
	$(BIN)/hdsim schema loadcycle -o scenarios/loadcycles/loadcycle.schema.json

pythons: $(STAMP)
	$(BIN)/python tests/pythons.py

blind: $(STAMP)
	$(BIN)/python tests/blind run --families numpy,mujoco,toothed,real --numbers 0-99 --seed 1 --jobs $(WORKERS) \
	  --results results/blind.jsonl
	$(BIN)/python tests/blind store --results results/blind.jsonl
	$(BIN)/python tests/blind page

site: $(STAMP)
	$(BIN)/python -m sphinx -q -E -W --keep-going -b html -d build/doctrees docs build/site
	@echo "the pages are in build/site/index.html"

picture: run
	cp logs/seed_move.png docs/images/seed_move.png
	$(BIN)/python docs/images/diagnose_report.py
	$(BIN)/python docs/images/tutorials.py

clean:
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .hypothesis build dist docs/generated
	rm -f logs/*.mcap logs/*.png logs/*.partial
	find hdsim tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
