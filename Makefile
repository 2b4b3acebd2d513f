PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test lint generate bench corpus report clean

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt torch
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[all,test,lint]'
	touch $@

demo: $(READY)
	$(BIN)/linkwise generate planar3 --out out
	$(BIN)/linkwise generate puma560 --out out
	$(BIN)/linkwise check out/planar3
	$(BIN)/linkwise check out/puma560
	$(BIN)/python tests/demo.py out

generate: $(READY)
	$(BIN)/linkwise generate planar3 --out generated
	$(BIN)/linkwise generate puma560 --out generated

test: $(READY)
	$(BIN)/python -m pytest

lint: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:
	rm -rf out $(VENV)
