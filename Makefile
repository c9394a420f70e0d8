# Thin over `python -m pipeline`; every target builds the environment first when it is missing.
PYTHON ?= python3.11
VENV   := .venv
PY     := $(VENV)/bin/python
STAMP  := $(VENV)/.installed
OUT    ?= reports/out
ROBOT  ?= urdf/hexapod.toml
LOG    ?= pipeline/identification/demo/walk.parquet
# The demonstration is tested on the same machine at another speed.
HOLDOUT := $(if $(filter file,$(origin LOG)),--holdout pipeline/identification/demo/walk_slow.parquet)
ARGS   ?=
# A name as one word of the shell, whatever is in it.
quoted = '$(subst ','\'',$(1))'

.DEFAULT_GOAL := help
.PHONY: help env reports choose gap blind calibrate test test-slow lint check bench faults readme urdf lock clean

help:  ## Print this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

env: $(STAMP)  ## Build the environment in .venv from the lock file

$(STAMP): requirements.lock pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet --require-hashes -r requirements.lock
	$(PY) -m pip install --quiet --no-deps -e .
	@touch $@

reports: $(STAMP)  ## Compute standing and walking, write CSV and figures to reports/out (OUT=, ROBOT=, ARGS=)
	$(PY) -m pipeline reports --robot $(call quoted,$(ROBOT)) --out $(call quoted,$(OUT)) $(ARGS)

choose: $(STAMP)  ## Which motor, gear and brake for a robot's day (ROBOT=, ARGS="--mission FILE")
	$(PY) -m pipeline choose --robot $(call quoted,$(ROBOT)) --out $(call quoted,$(OUT)/choose) $(ARGS)

test: $(STAMP)  ## Run the tests (Table III among them)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PY) -m pytest -n auto --dist loadfile -m "not slow"

test-slow: $(STAMP)  ## Run the long tests
	$(PY) -m pytest -m slow

lint: $(STAMP)  ## Check style, types and what imports what
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(VENV)/bin/lint-imports --no-logo --no-cache

check: $(STAMP)  ## Check the robot model for physical sense (ROBOT=)
	$(PY) -m pipeline check $(call quoted,$(ROBOT))

bench: $(STAMP)  ## Print speed ratios measured in one run
	$(PY) -m tests.bench

faults: $(STAMP)  ## Put the faults of tests/faults.toml into the code: do tests notice? (ARGS=)
	$(PY) -m tests.faults $(ARGS)

readme: $(STAMP)  ## Renew the tables and pictures of the pages from a run
	$(PY) -m tests.readme

# Exit 1 is a finding (something stays unexplained), not an error of make. LOG= is one file, whose
# name may hold spaces, or several.
gap: $(STAMP)  ## Find what the model lacks, from a measured log (LOG=, ROBOT=, ARGS=); a demonstration by default
	@if [ -e $(call quoted,$(LOG)) ]; then set -- $(call quoted,$(LOG)); else set -- $(LOG); fi; \
	$(PY) -m pipeline gap "$$@" $(HOLDOUT) --robot $(call quoted,$(ROBOT)) \
	  --out $(call quoted,$(OUT)/gap) $(ARGS) || { code=$$?; \
	  if [ $$code -eq 1 ]; then echo "finding: a significant part of the gap stays unexplained"; \
	  else exit $$code; fi; }

blind: $(STAMP)  ## Hide effects in simulated machines and see whether gap finds them (resumes; OUT=, ARGS=)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PY) -m tests.blind --out $(call quoted,$(OUT)/blind) --resume $(ARGS) \
	  || { code=$$?; if [ $$code -eq 1 ]; then echo "finding: an aim was not reached"; else exit $$code; fi; }

calibrate: $(STAMP)  ## Fit the unpublished numbers to the paper anew (about 15 minutes; ARGS=)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(PY) -m pipeline.paper.calibration $(ARGS)

urdf: $(STAMP)  ## Build the URDFs from their TOML
	$(PY) -m pipeline.robot.urdf

lock:  ## Resolve the dependencies anew into requirements.lock (needs pip-tools)
	pip-compile --quiet --generate-hashes --no-emit-index-url --no-emit-find-links \
	  --no-emit-trusted-host --strip-extras --extra dev --extra bags --allow-unsafe \
	  -o requirements.lock pyproject.toml

clean:  ## Remove what a run wrote
	rm -rf reports/out .pytest_cache .mypy_cache .ruff_cache .hypothesis
