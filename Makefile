# `make demo` and `make test` are all that a fresh machine with Python >= 3.11, git and make needs.

PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	command -v $$p >/dev/null && $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' && echo $$p && break; done)
BIN := .venv/bin
PACKAGES := ingest preprocess identify validate seatrial fixtures benchmarks
INSTALLED := .venv/.installed
NEVER_IMPORTED := /(tests|mypy|mypyc|fontTools|jedi|pip|setuptools|pkg_resources)/|/dialects/(?!v20/(common|ardupilotmega)\.)
QUIETLY := --quiet --disable-pip-version-check --no-compile
WORKERS ?= 2
# More than there are processors: those that wait for a device leave theirs to others.
TEST_WORKERS ?= 3

.PHONY: install demo test check format bench bench-blind papers soak docs wheel clean

install: $(INSTALLED)

$(INSTALLED): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed: make PYTHON=/path/to/python3"; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@# uv takes a fifth of the time that pip takes, which does it where uv cannot be had or does not reach the packages
	$(BIN)/python -m pip install $(QUIETLY) 'uv>=0.9,<1' && \
		$(BIN)/uv pip install --quiet --python $(BIN)/python -c constraints.txt -e '.[dev]' || \
		$(BIN)/python -m pip install $(QUIETLY) -c constraints.txt -e '.[dev]'
	@# on all cores (pip would on one), less what is hardly ever imported
	@$(BIN)/python -m compileall -q -j 0 -x '$(NEVER_IMPORTED)' .venv/lib $(PACKAGES) >/dev/null 2>&1 || true
	@touch $@

demo: $(INSTALLED)  ## run the campaign that comes with the program
	$(BIN)/seatrial demo

test: $(INSTALLED)  ## every test; those of a file on one worker, which share what they prepare
	$(BIN)/python -m pytest -n $(TEST_WORKERS) --dist loadgroup --no-loadscope-reorder

check: $(INSTALLED)  ## style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(INSTALLED)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

BENCHMARKS ?= ingest preprocess lssvm rollout output_error first_call

bench: $(INSTALLED)  ## the benchmarks that need no data but what they make (BENCHMARKS="ingest lssvm")
	@for name in $(BENCHMARKS); do echo "bench_$$name"; $(BIN)/python -m benchmarks.bench_$$name || exit 1; done

CASES ?= 640

bench-blind: $(INSTALLED)  ## diagnoses of campaigns drawn at random against the truth (CASES=640)
	$(BIN)/python -m benchmarks.blind --cases $(CASES) --workers $(WORKERS)

papers: $(INSTALLED)  ## the tables of the source papers, theirs beside ours
	$(BIN)/python -m benchmarks.papers

SOAK_SECONDS ?= 600

soak: $(INSTALLED)  ## capture from four ports at 921,600 baud, every byte checked (SOAK_SECONDS=600)
	$(BIN)/python -m benchmarks.soak_capture --seconds $(SOAK_SECONDS)

docs: $(INSTALLED)  ## the documents, with the reference made from the code, in build/docs
	$(BIN)/python docs/generate.py
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs build/docs
	@echo build/docs/index.html

wheel: $(INSTALLED)
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .

clean:
	rm -rf .venv dist build
