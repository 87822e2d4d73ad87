# Everything runs in .venv, which the first target that needs it creates.
#
#   make demo    stiffness, free motions and deflection of shipped robots, and a report
#   make test    the tests, doctests included
#
# PYTHON names the interpreter that creates .venv; PYTEST_ARGS is handed to pytest.

PYTHON ?= python3
# Neighbours run in one process, where formulas are derived once; who ends first takes over the rest.
PYTEST_ARGS ?= -n 2 --dist worksteal
VENV := .venv
ifeq ($(OS),Windows_NT)
SHELL := bash
BIN := $(VENV)/Scripts
INTERPRETER := $(BIN)/python.exe
else
BIN := $(VENV)/bin
INTERPRETER := $(BIN)/python
endif
STAMP := $(VENV)/.installed
# Bytecode is written when a module is imported first: of most it never is.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile \
  --constraint constraints.txt

# Tests start some two hundred processes; without bytecode each compiles all modules anew.
unexport PYTHONDONTWRITEBYTECODE
CAMPAIGN_ARGS ?=
OTHERS := robostiff-view robostiff-interop
EDITABLE_OTHERS := $(addprefix --editable extras/,$(OTHERS))
EXTRAS ?=
.PHONY: help demo test slow peers processors campaign extras lint format docs outputs bench proof clean
.NOTPARALLEL:

help:
	@echo "make demo    stiffness, free motions and deflection of shipped robots, and a report"
	@echo "make test    the tests, doctests included (PYTEST_ARGS='-x tests/paper' runs some)"
	@echo "make peers   comparisons with other programs, whose packages take 1.5 GB"
	@echo "make slow    those, and the tests that take long: many more poses, long runs"
	@echo "make extras  the wheel alone and with each extra alone, at newest and lowest versions"
	@echo "make processors  the numerical tests with the arithmetic of other processors"
	@echo "make campaign  20,000 random robots, mutated files and stores through every way (30 minutes)"
	@echo "make lint    ruff, pyright, types of all that is public, direction of imports"
	@echo "make format  let ruff put code in order"
	@echo "make docs    the documentation, into docs/_build/html"
	@echo "make outputs what the documents show: picture, list of robots, printed output"
	@echo "make bench   time and accuracy, printed as tables"
	@echo "make proof   what was promised and what is measured, as the table of ARCHITECTURE.md"
	@echo "make clean   remove .venv and everything built"

demo: $(STAMP)-demo
	$(BIN)/robostiff stiffness hexapod --pose '60 mm 20 mm 0.9 0 10 deg 0'
	@echo
	$(BIN)/robostiff deflection hexapod --pose '60 mm 20 mm 0.9 0 10 deg 0' \
	  --wrench '300 N 100 N -200 N 0 0 0'
	@echo
	$(BIN)/robostiff stiffness gough-stewart-a
	@echo
	@mkdir -p build
	$(BIN)/robostiff report hexapod --pose '60 mm 20 mm 0.9 0 10 deg 0' \
	  --wrench '300 N 100 N -200 N 0 0 0' --pdf \
	  -o build/hexapod.html --overwrite

test: $(STAMP)-test
	$(BIN)/python -m pytest $(PYTEST_ARGS)

slow: $(STAMP)-peers
	$(BIN)/python -m pytest $(PYTEST_ARGS) -q -m 'slow or peer'

# Where they are, so that no other test is collected.
PEER_TESTS = $(shell grep -rlE 'mark[.]needs|urdf[.]examples' tests --include='test_*.py')

peers: $(STAMP)-peers
	$(BIN)/python -m pytest $(PYTEST_ARGS) -q -m 'peer and not slow' $(PEER_TESTS)

extras: $(INTERPRETER)
	$(PIP) uv
	$(BIN)/python tests/project/extras_alone.py $(EXTRAS)

# OpenBLAS and NumPy choose their loops by processor, and these round differently; messages do not.
# Those of the processor at hand run in `make test`; symbols and machine code feel nothing of it.
# Without AVX-512 these are OpenBLAS's loops of Haswell, to the last bit (of Zen, too).
# NumPy's own loops, of which records are, round differently with AVX-512 alone; linear algebra,
# of which legs and robots are, by each kind of processor.
BY_LINEAR_ALGEBRA := $(addprefix tests/,laws cases elastostatics)
BY_LOOPS := $(addprefix tests/,paper recorded) \
  $(addprefix tests/compiled/test_,array_loops.py codes.py guard.py)
NUMERICAL := -k 'not with_symbols' --ignore=tests/paper/test_slips.py \
  --ignore=tests/laws/test_odd_arguments.py
NO_AVX512 := NPY_DISABLE_CPU_FEATURES="X86_V4 AVX512_ICL AVX512_SPR"

processors: $(STAMP)-peers
	@if grep -qs avx512f /proc/cpuinfo; then set -ex; \
	  OPENBLAS_CORETYPE=Haswell $(NO_AVX512) $(BIN)/python -m pytest $(PYTEST_ARGS) -q \
	    $(BY_LINEAR_ALGEBRA) $(BY_LOOPS) $(NUMERICAL); \
	fi
	OPENBLAS_CORETYPE=Prescott $(BIN)/python -m pytest $(PYTEST_ARGS) -q \
	  $(BY_LINEAR_ALGEBRA) $(NUMERICAL)

campaign: slow
	$(BIN)/python -m pytest $(PYTEST_ARGS) -q --hypothesis-profile=campaign tests/laws
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.campaign $(CAMPAIGN_ARGS)

lint: $(STAMP)-lint $(STAMP)-peers
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports
	$(BIN)/pyright --threads 2
	$(BIN)/pyright --project tests/typed
	PATH="$(BIN):$$PATH" $(BIN)/python -m tests.typed.public_symbols

format: $(STAMP)-lint
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

docs: $(STAMP)-docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "built docs/_build/html/index.html"

outputs: $(STAMP)-peers $(STAMP)-docs
	$(BIN)/python docs/make_picture.py docs/_static/gough-stewart-a.png
	$(BIN)/python docs/make_plots.py
	$(BIN)/python docs/make_report_picture.py docs/_static/report.png
	$(BIN)/python examples/orthoglide_against_3_puu.py docs/_static/orthoglide-against-3-puu.png > /dev/null
	$(BIN)/python docs/make_robots_page.py > docs/robots.new && mv docs/robots.new docs/robots.md
	$(BIN)/python docs/make_arguments_page.py > docs/arguments.new && mv docs/arguments.new docs/arguments.md
	$(BIN)/python -m tests.project.shown_output

bench: $(STAMP)-bench
	$(BIN)/python benchmarks/every_job.py
	$(BIN)/python benchmarks/batched_stiffness.py
	$(BIN)/python benchmarks/one_pose_and_many.py
	$(BIN)/python benchmarks/accuracy_of_forms.py
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python benchmarks/derivations.py
	$(BIN)/python benchmarks/map_overhead.py
	$(BIN)/python benchmarks/map_rate.py
	$(BIN)/python benchmarks/kernels.py
	$(BIN)/python benchmarks/closed_by_steps.py
	$(BIN)/python benchmarks/linkages.py
	$(BIN)/python benchmarks/map_workers.py
	$(BIN)/python benchmarks/under_load.py
	$(BIN)/python benchmarks/view.py
	$(BIN)/python benchmarks/size.py

proof: $(STAMP)-bench
	$(BIN)/python benchmarks/proof.py

clean:
	rm -rf $(VENV) docs/_build docs/gallery build dist .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find src extras tests docs benchmarks examples -name __pycache__ -type d -prune -exec rm -rf {} +

$(INTERPRETER):
	@command -v $(PYTHON) > /dev/null || { \
	  echo "robostiff needs Python 3.11 or newer, and there is no '$(PYTHON)' here:"; \
	  echo "install it, or name another: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "robostiff needs Python 3.11 or newer, and '$(PYTHON)' is $$($(PYTHON) --version):"; \
	  echo "name another: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2> /dev/null || { \
	  echo "'$(PYTHON)' cannot make virtual environments; on Debian and Ubuntu:"; \
	  echo "apt install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# Each installs all that it needs by one call of pip, which builds the project each time.
NEEDS := pyproject.toml constraints.txt | $(INTERPRETER)

$(STAMP)-demo: $(NEEDS)
	$(PIP) --editable '.[plot,pdf]'
	@touch $@

$(STAMP)-test: $(OTHERS:%=extras/%/pyproject.toml) $(NEEDS)
	$(PIP) --editable '.[test]' $(EDITABLE_OTHERS)
	@touch $@

# Other programs to compare with, and the compiler of kernels.
$(STAMP)-peers: $(OTHERS:%=extras/%/pyproject.toml) $(NEEDS)
	$(PIP) --editable '.[test,peers]' $(EDITABLE_OTHERS)
	@touch $@

$(STAMP)-bench: $(STAMP)-peers
	$(PIP) --editable '.[test,peers,bench]'
	@touch $@

# Pyright runs on Node.js, which need not be there: it comes as a wheel.
$(STAMP)-lint: $(NEEDS)
	$(PIP) --editable '.[lint]' 'pyright[nodejs]'
	@touch $@

$(STAMP)-docs: $(OTHERS:%=extras/%/pyproject.toml) $(NEEDS)
	$(PIP) --editable '.[docs,fast,maps,plot]' $(EDITABLE_OTHERS)
	@touch $@
