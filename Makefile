# `make` alone lists what there is. Everything lives in .venv; nothing else is touched.

# `make env PYTHON=...` makes .venv with that one; otherwise the first that fits is taken.
PYTHON ?=
BIN := .venv/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# pip before 25.3 reads the first for isolated builds as well, later ones the second. Both hold a list that is split
# at blanks, which a relative path has none of. Two times quiet: only errors; a warning of an extra is no user's concern.
INSTALL := PIP_CONSTRAINT=constraints.txt PIP_BUILD_CONSTRAINT=constraints.txt $(BIN)/pip install -qq --editable

.DEFAULT_GOAL := help
.PHONY: help env sim serve operate map world scenarios quick test long test-all-pythons check format docs release bench clean

# `make quick AREA=localization` runs the tests of one package, or of one folder of it.
AREA ?=
AREAS := $(if $(AREA),$(firstword $(wildcard tests/$(AREA) tests/teleop/$(AREA)) tests/$(AREA)),)
# A test's threads would only compete with the other processes. Measuring coverage takes processor time of its own, so
# the limit for tests without a mark is wider there.
# Where PYTHONDONTWRITEBYTECODE is set, each of the hundred processes that tests start would compile our files anew.
PYTEST := OPENBLAS_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= $(BIN)/pytest --numprocesses auto --dist worksteal
# Tests wait now and then: with one process more than cores the quick ones take a seventh less.
MORE := --numprocesses $$(($$(getconf _NPROCESSORS_ONLN) + 1))

# The console page is built from all of these; a folder is newer when a file is added to or removed from it.
PAGE := teleop/console/page
PAGE_SOURCES := $(shell find $(PAGE) assets/operating assets/joysticks \( -name node_modules -o -name dist \) -prune -o -print 2>/dev/null)
# pip would build it as well, in an environment that is thrown away afterwards.
export FARSTEER_SKIP_CONSOLE := 1

help: ## List these targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' Makefile
	@echo "All commands, also those without a target: .venv/bin/farsteer --help"

env: .venv/.env .venv/.page ## Make .venv with what running needs, in pinned versions, and the console page

sim: .venv/.env ## Drive the robot in simulation (ARGS="--help" says what else)
	@$(BIN)/farsteer sim $(ARGS)

serve: .venv/.env .venv/.page ## Serve a robot and the page to drive it; it prints the address (ARGS="--lan")
	@$(BIN)/farsteer serve $(if $(or $(findstring --lan,$(ARGS)),$(findstring --host,$(ARGS)),$(findstring --lockstep,$(ARGS))),,--playground) $(ARGS)

operate: .venv/.env ## Operate it from a terminal: rerun and keyboard (ARGS="ws://host:port --no-viewer --record x.rrd")
	@$(BIN)/farsteer operate $(ARGS)

map: .venv/.map ## Build the office's map from a simulated drive (ARGS="...")
	@$(BIN)/farsteer map office $(ARGS)

world: .venv/.map ## Generate, import and list worlds (ARGS="generate --seed 7 --area 400")
	@$(BIN)/farsteer world $(ARGS)

# One thread for each of the processes, of which there is one for each core.
scenarios: .venv/.env ## Run and judge all scenarios, on all cores; reports in runs/scenarios (ARGS="--seed 3")
	@OPENBLAS_NUM_THREADS=1 $(BIN)/farsteer scenario run scenarios --out runs/scenarios --overwrite $(ARGS)

quick: .venv/.dev ## Run the tests to run after each change (AREA=localization for one package)
	@$(PYTEST) $(MORE) -q -m "not slow and not process and not sweep" $(AREAS) $(ARGS)

test: .venv/.dev ## Run the tests but the long ones (ARGS="-k name" for some)
	@tools/test-setup
	@FARSTEER_TEST_CPU_FACTOR=3 $(PYTEST) $(MORE) -m "not long" $(ARGS)

long: .venv/.dev ## Run the long tests, which `make test` leaves out (ARGS="-k name" for some)
	@tools/test-setup
	@$(PYTEST) -m long $(ARGS)

test-all-pythons: ## Run all tests on Python 3.11, 3.12 and 3.13, each in an environment of its own
	@tools/test-setup
	@tools/test-all-pythons $(ARGS)

check: .venv/.dev ## Check format, lint, types, layers and spelling; changes nothing
	@$(BIN)/ruff format --check
	@$(BIN)/ruff check
	@$(BIN)/mypy
	@$(BIN)/lint-imports
	@$(BIN)/codespell
	@tools/check-words
	@$(BIN)/python tools/build-console --fetch-node --dev check

format: .venv/.dev ## Format the code and mend what can be mended
	@$(BIN)/ruff format
	@$(BIN)/ruff check --fix

docs: .venv/.dev ## Build the API reference in build/api, offline; a warning is an error
	@$(BIN)/python tools/build-api-reference build/api

release: .venv/.dev ## Build sdist and wheel in dist/, check them, and install the sdist elsewhere
	@tools/build-release

bench: .venv/.dev ## Run the benchmarks (ARGS="...")
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks $(ARGS)

clean: ## Remove .venv and everything that was generated
	rm -rf $(PAGE)/dist $(PAGE)/node_modules .venv .cache .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamps are renewed only when what they depend on has changed.
.venv/.env: pyproject.toml constraints.txt
	@test -x $(BIN)/pip || { python=$$(tools/find-python $(PYTHON)) && "$$python" -m venv .venv; }
	@echo "Installing what running needs into .venv: downloads 390 MB, takes 1.5 GB and a minute or more"
	@$(INSTALL) '.[sim,operator,lan,camera,arm,servos]'
	@touch $@

# Without the page the robot drives all the same, so that a failure is no error; it is tried again the next time.
.venv/.page: .venv/.env $(PAGE_SOURCES) tools/build-console
	@if $(BIN)/python tools/build-console --fetch-node; then touch $@; fi

.venv/.map: .venv/.env
	@echo "Installing what building maps needs: downloads another 130 MB"
	@$(INSTALL) '.[sim,operator,lan,camera,arm,servos,map]'
	@touch $@

.venv/.dev: .venv/.env | .venv/.page
	@echo "Installing what tests and checks need: downloads another 200 MB, with those for maps"
	@$(INSTALL) '.[sim,operator,lan,camera,arm,servos,map,dev]'
	@touch $@
