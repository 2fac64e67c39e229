# Two commands do everything on a fresh machine: `make reproduce` and `make test`; `make quick` is for every day.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
CORES := $(shell nproc 2>/dev/null || echo 2)
QUICK_TESTS := tests/architecture tests/contract/test_command_words.py tests/contract/test_catalogs.py $(addprefix tests/unit/,\
	test_public_interface.py test_units.py control documents gait metrics model parameters signals storage)

.PHONY: reproduce gallery validation test coverage quick check format bench bits dist page site lock clean

reproduce: $(READY)
	$(BIN)/ppafo reproduce --out out/reproduce

# Ready workbenches, each one file that simulates in a browser: out/gallery/*.html.
gallery: $(READY)
	$(BIN)/python scripts/gallery.py out/gallery

# What was judged by what, with which result, and what was not: out/validation/report.md. Half an hour; goes on where it was interrupted.
validation: $(READY)
	$(BIN)/python scripts/validation_report.py --out out/validation

test: check
	$(BIN)/python -m pytest -n $(CORES) --dist loadfile

# The last line is branch coverage of the package in percent; `coverage report --sort=miss` says where it is not. Compiled code is not seen.
coverage: $(READY)
	$(BIN)/python -m pytest -n $(CORES) --dist loadfile --cov --cov-report=
	$(BIN)/coverage report --format=total

# What needs no compiled model, of the tests whose process costs little: well under a minute where the caches of the tools are warm.
quick: check
	$(BIN)/python -m pytest -n $(CORES) --quick $(QUICK_TESTS)

check: $(READY)
	$(BIN)/ruff format --check src tests benchmarks scripts
	$(BIN)/ruff check src tests benchmarks scripts
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY)
	$(BIN)/ruff format src tests benchmarks scripts
	$(BIN)/ruff check --fix src tests benchmarks scripts

# The benchmark also needs JAX, which is large; it goes into the same environment, from its own lock file.
bench: $(READY)
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements-bench.lock
	$(BIN)/python -m benchmarks --out out/bench

# Whether every run has its golden bits on several processors, by several compilers and on emulated machines: an hour or more.
# 'python scripts/bits.py --renew' writes the golden hashes anew, after a change that is meant to change numbers.
bits: $(READY)
	$(BIN)/python scripts/bits.py

# Wheel and source archive in dist/, built twice, checked, and tried in an empty environment.
dist: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements-release.lock
	$(BIN)/python scripts/dist.py

# The documents as a site that opens from its folder: out/site/index.html; warnings are errors, links are checked.
site: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements-docs.lock
	$(BIN)/python -m scripts.website out/site

# Script and style of the page that simulates, from page/ into the package; needs node, which nobody else does.
page:
	npm ci --prefix page --no-audit --no-fund
	npm run --prefix page check
	npm run --prefix page build

$(READY): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "ppafo needs Python 3.11 or newer; try: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $(READY)

# Writes the lock files anew (needs uv); everybody else only reads them.
lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --extra dev --output-file requirements.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --extra dev --extra bench --constraint requirements.lock --output-file requirements-bench.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --extra dev --extra release --constraint requirements.lock --output-file requirements-release.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --extra dev --extra docs --constraint requirements.lock --output-file requirements-docs.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --extra dev --extra opensim --constraint requirements.lock --output-file requirements-opensim.lock pyproject.toml

clean:
	rm -rf $(VENV) out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .coverage
