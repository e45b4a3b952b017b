# On a fresh machine with Python 3.11 or newer and make:
#     make report     sets up .venv, then writes the report on the bundled five-bar to out/
#     make test       sets up .venv with what the tests want, then runs them
# The set-up happens once, and again only when pyproject.toml or the constraints change; kernels are compiled once, and
# again where their sources change.

DEVICE  ?= five-bar
PYTHON  ?= python3 python3.13 python3.12 python3.11 python
# The tests to run; none named: all, of the everyday suite or of the longer studies.
TESTS   ?=
# A choice of tests instead, by what they cover: quick, numerical or interfaces (tests/verdict).
CHOICE  ?=

# What `record`, `structure` and `bench-pairs` compare with what is here, or with the commit NEW. Left out, pairs
# are timed with the commit at which main was left.
BASE    ?= main
# What else `bench-pairs` is told: --only 'maps: *' --pairs 5
PAIRS   ?=
# What else `bench-check` is told: --only 'maps: *', or --keep
CHECK   ?=

# Another environment beside the first, with another Python or other versions of what zwidth needs:
#     make test VENV=.venv-lowest PYTHON=python3.11 CONSTRAINTS=constraints-lowest.txt
VENV        := .venv
CONSTRAINTS := constraints.txt
BIN     := $(VENV)/bin
NUMERICAL := $(addprefix tests/,chart conditions contact guarantees loop measures model reproduction study)
# UV=uv installs the same pinned releases with uv, in a fraction of pip's time; it does not read pip's settings.
UV      ?=
INSTALL  = $(if $(UV),$(UV) pip install --python $(BIN)/python --constraint $(CONSTRAINTS) \
               --build-constraint $(CONSTRAINTS),$(BIN)/python -m pip install) --quiet
OUTPUT   = out/$(basename $(notdir $(DEVICE))).html

# Relative on purpose: pip splits this variable at blanks, and a folder's name may hold one.
# Newer releases of pip read the second for the build backend, older ones the first.
export PIP_CONSTRAINT := $(CONSTRAINTS)
export PIP_BUILD_CONSTRAINT := $(CONSTRAINTS)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Where it is set, every process that a test starts compiles all modules of the package anew, some seconds each.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help report test quick affected older-processor record structure slow lint stubs compile-check bench bench-check bench-pairs wasm wheel docs clean

help:
	@echo 'make report   the report on a device (DEVICE=$(DEVICE)), into $(OUTPUT)'
	@echo 'make test     the test suite, or TESTS=... of it'
	@echo 'make quick    a choice of tests over all packages, within a minute'
	@echo 'make affected  the tests that cover what has changed since BASE=$(BASE)'
	@echo 'make older-processor  the numerical tests, or TESTS=..., as a processor without AVX2 runs them'
	@echo 'make record   every number of two commits beside each other: BASE=$(BASE), and NEW or what is here'
	@echo 'make structure  files, lines, import circles and names of two commits beside each other: BASE, NEW'
	@echo 'make slow     the longer studies, or those in TESTS=...: thousands of random loops'
	@echo 'make lint     style and types'
	@echo 'make stubs    whether types and signatures are those that Python finds in the package'
	@echo 'make compile-check  how many kernels are compiled at first use, against what is allowed'
	@echo 'make bench    how fast, beside what a competent user would write otherwise'
	@echo 'make bench-check  whether a case of it takes more than twice as long as kept; CHECK=... more options'
	@echo 'make bench-pairs  our own part of it at two commits in turn: BASE, and NEW or what is here'
	@echo 'make wasm     the contact kernel of the page as WebAssembly, from its Python source; wants wasm-ld'
	@echo 'make wheel    a wheel in dist/ that carries compiled kernels, for this Python and platform'
	@echo 'make docs     write the generated pages and pictures of docs/ again'
	@echo 'make clean    remove what was made, all but $(VENV)'

report: $(VENV)/.kernels
	@mkdir -p $(dir $(OUTPUT))
	$(BIN)/zwidth report $(DEVICE) --output $(OUTPUT)

# Each worker takes its tests as they stand, so that what a file's tests share is computed once.
test: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m $(if $(CHOICE),tests.verdict $(CHOICE),pytest -n auto --dist worksteal $(TESTS))

quick: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m tests.verdict quick

affected: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m tests.verdict affected $(BASE)

older-processor: $(VENV)/.installed-test
	$(BIN)/python tests/older_processor.py AVX2 \
	  $(if $(CHOICE),--choice $(CHOICE),-n auto --dist worksteal $(or $(TESTS),$(NUMERICAL)))

record: $(VENV)/.installed-test
	$(BIN)/python -m tests.frozen $(BASE) $(NEW)

structure: $(VENV)/bin/python
	$(BIN)/python -m tests.structure $(BASE) $(NEW)

slow: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m pytest -n auto --dist worksteal -m slow $(TESTS)

# Exit code 2 is no finding: mypy stumbles over what it has kept of an older or an interrupted run.
lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy || { [ $$? -eq 2 ] && rm -rf "$${MYPY_CACHE_DIR:-.mypy_cache}" && $(BIN)/mypy; }

# Whether what a type checker reads of the package is what Python finds there; it reads all sources anew.
stubs: $(VENV)/.installed-test
	$(BIN)/stubtest zwidth --mypy-config-file pyproject.toml --concise \
	    --allowlist tests/stubtest_allowed.txt --ignore-unused-allowlist

# No more may be compiled at first use than a number in the script allows.
compile-check: $(VENV)/.installed-test
	PYTHONPATH=. $(BIN)/python benchmarks/_compiling.py --check

bench: $(VENV)/.installed-test $(VENV)/.kernels
	@set -e; for script in benchmarks/[!_]*.py; do echo "== $$script"; $(BIN)/python "$$script"; done

# By processor time, in multiples of a fixed piece of work; CHECK='--keep' writes the ratios that are kept.
bench-check: $(VENV)/.installed-test $(VENV)/.kernels
	$(BIN)/python -m benchmarks._check $(CHECK)

bench-pairs: $(VENV)/.installed-test
	$(BIN)/python -m benchmarks._pairs $(if $(filter file,$(origin BASE)),,--base $(BASE)) \
	  $(if $(NEW),--new $(NEW)) $(PAIRS)

# The result is committed; the same sources and releases of numba and llvmlite give the same bytes.
wasm: $(VENV)/.installed
	$(BIN)/python tools/build_touch_wasm.py

# For this Python and this platform, with the machine code of all kernels: nothing is compiled at first use.
wheel: $(VENV)/.installed
	$(BIN)/python tools/build_wheel.py dist

docs: $(VENV)/.installed-test
	@set -e; for script in docs/[!_]*.py; do echo "== $$script"; $(BIN)/python "$$script"; done

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find src tests benchmarks gallery docs -name __pycache__ -prune -exec rm -rf {} +

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml $(CONSTRAINTS)
	@echo 'Installing zwidth into $(VENV); the first time takes a few minutes.'
	$(INSTALL) --editable .
	@touch $@

$(VENV)/.installed-test: $(VENV)/bin/python pyproject.toml $(CONSTRAINTS)
	@echo 'Installing zwidth and its tests into $(VENV); the first time takes a few minutes.'
	$(INSTALL) --editable '.[test]'
	@touch $(VENV)/.installed $@

# All kernels at once, for this processor; machine code whose sources are unchanged is kept.
$(VENV)/.kernels: $(VENV)/.installed $(shell find src -name '*.py' 2>/dev/null)
	@$(BIN)/zwidth compile
	@touch $@

# The first interpreter of PYTHON that is new enough; uv where it is named, else venv, else virtualenv, else one
# sentence.
$(VENV)/bin/python:
	@found=''; \
	for python in $(PYTHON); do \
	  if $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then \
	    found=$$python; break; \
	  fi; \
	done; \
	if [ -z "$$found" ]; then \
	  echo 'zwidth needs Python 3.11 or newer, and none of these is: $(PYTHON); install one, or name it: make PYTHON=/path/to/python3.' >&2; \
	  exit 1; \
	fi; \
	for maker in $(if $(UV),"$(UV) venv --quiet --seed --python $$found") "$$found -m venv" "$$found -m virtualenv" "virtualenv --python $$found"; do \
	  rm -rf $(VENV); \
	  if $$maker $(VENV) >/dev/null 2>&1; then exit 0; fi; \
	done; \
	rm -rf $(VENV); \
	echo "$$found can make no virtual environment: install its venv module (python3-venv on Debian and Ubuntu) or virtualenv, then run make again." >&2; \
	exit 1
