# Two commands do everything on a fresh machine: `make reproduce` and `make test`; `make quick` is for every day.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
LEAN := $(VENV)/.ready-to-run
READY := $(VENV)/.ready
CORES := $(shell nproc 2>/dev/null || echo 2)
QUICK_TESTS := tests/architecture tests/contract/test_command_words.py tests/contract/test_catalogs.py $(addprefix tests/unit/,\
	test_public_interface.py test_units.py control documents gait metrics model parameters signals storage)

.PHONY: reproduce validation test test-long test-all test-processors test-host coverage quick check format bench bits dist site lock clean

reproduce: $(LEAN)
	$(BIN)/ppafo reproduce --out out/reproduce

# What was judged by what, with which result, and what was not: out/validation/report.md. Half an hour; goes on where it was interrupted.
validation: $(READY)
	$(BIN)/python scripts/validation_report.py --out out/validation

# What users meet and what everything rests on, in minutes; costly tests are marked as long, and tests/costs.toml has what files cost.
test: check
	$(TESTS) -m "not long"

# What `make test` leaves out. Continuous integration runs an eighth of it after each change: PART=I/8 is the I-th of eight parts
# of about equal cost.
PART ?= 0/1
test-long: $(READY)
	$(TESTS) -m long --part $(PART)

# Everything there is.
test-all: check
	$(TESTS)

# Whether fits and searches print the same by each kernel of linear algebra that this computer runs, and the short tests of
# what fits and compares, by each.
PROCESSORS ?= $(shell $(BIN)/python scripts/kernels.py)
FITTING := $(addprefix tests/unit/,identification/bench identification/trajectory $(addprefix identification/test_,fit.py\
	identify.py trajectory_section.py) $(addprefix validation/test_,causes.py compare_recording.py inputs.py)\
	$(addprefix studies/test_,draws.py sampling.py))
test-processors: $(READY)
	$(BIN)/python scripts/kernels.py $(PROCESSORS)
	set -e; for kernel in $(PROCESSORS); do OPENBLAS_CORETYPE=$$kernel $(TESTS) -m "not long" $(FITTING); done

# The short tests of what a host program asks for, in one that has set decimals, errors of NumPy, locale and warnings in its own way.
HOSTED := tests/contract/test_docstring_examples.py tests/unit/test_units.py tests/unit/test_results_at_hand.py \
	$(addprefix tests/unit/,arguments control documents metrics parameters signals storage)
test-host: $(READY)
	$(TESTS) -p tests.hostile_host -m "not long" $(HOSTED)

# Kept as bytecode, tests and libraries begin at once in the next run, whatever the surroundings say of it.
test test-long test-all test-processors test-host quick coverage: export PYTHONDONTWRITEBYTECODE =
TESTS := $(BIN)/python -m pytest -n $(CORES) --dist loadfile --no-loadscope-reorder --costs show

# The last line is branch coverage of the package in percent; `coverage report --sort=miss` says where it is not. Compiled code is not seen.
coverage: $(READY)
	$(BIN)/python -m pytest -n $(CORES) --dist loadfile --cov --cov-report=
	$(BIN)/coverage report --format=total

# The checks, and the tests of what everything rests on: less than a minute.
quick: check
	$(TESTS) -m "not long" $(QUICK_TESTS)

check: $(READY)
	$(BIN)/ruff format --check src tests benchmarks scripts
	$(BIN)/ruff check src tests benchmarks scripts
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY)
	$(BIN)/ruff format src tests benchmarks scripts
	$(BIN)/ruff check --fix src tests benchmarks scripts

bench: $(READY)
	$(BIN)/python -m benchmarks --out out/bench

# Whether every run has its golden bits on several processors, by several compilers and on emulated machines: an hour or more.
# 'python scripts/bits.py --renew' writes the golden hashes anew, after a change that is meant to change numbers.
bits: $(READY)
	$(BIN)/python scripts/bits.py

# Wheel and source archive in dist/, built twice, checked, and tried in an empty environment.
dist: $(READY)
	$(call install,requirements-release.lock)
	$(BIN)/python scripts/dist.py

# The documents as a site that opens from its folder: out/site/index.html; warnings are errors, links are checked.
site: $(READY)
	$(call install,requirements-docs.lock)
	$(BIN)/python -m scripts.website out/site

# The environment of `make reproduce`: what a run needs.
$(LEAN): requirements.lock requirements-uv.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "ppafo needs Python 3.11 or newer; try: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	command -v uv >/dev/null || $(PIP) --require-hashes --requirement requirements-uv.lock || echo "uv could not be installed: pip takes its place"
	$(call install,requirements.lock)
	$(call install_with,--no-deps --no-build-isolation --editable .)
	touch $(LEAN)

# And what checks, tests and documents need beside it.
$(READY): $(LEAN) requirements-dev.lock
	$(call install,requirements-dev.lock)
	touch $(READY)

# uv installs in seconds what takes pip most of a minute; where it fails, for instance behind a proxy that only pip knows, pip tries too.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
install_with = PATH="$$PATH:$(BIN)" uv pip install --quiet --python $(BIN)/python $(1) || $(PIP) $(1)
install = $(call install_with,--require-hashes --requirement $(1))

# Writes the lock files anew (needs uv); everybody else only reads them. Each of the last two holds one extra, in versions that go with the others.
COMPILE := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header
lock:
	$(COMPILE) --extra checkout --output-file requirements.lock pyproject.toml
	$(COMPILE) --extra checkout --extra dev --constraint requirements.lock --output-file requirements-dev.lock pyproject.toml
	echo uv | $(COMPILE) --output-file requirements-uv.lock -
	for extra in docs release; do \
		$(COMPILE) --extra $$extra --constraint requirements-dev.lock --output-file requirements-$$extra.lock pyproject.toml || exit 1; done

clean:
	rm -rf $(VENV) out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .coverage
