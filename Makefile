# `make` alone lists what there is. Everything lives in .venv; nothing else is touched.

# `make env PYTHON=...` makes .venv with that one; otherwise the first that fits is taken.
PYTHON ?=
BIN := .venv/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# pip before 25.3 reads the first for isolated builds as well, later ones the second.
export PIP_CONSTRAINT := $(CURDIR)/constraints.txt
export PIP_BUILD_CONSTRAINT := $(CURDIR)/constraints.txt

.DEFAULT_GOAL := help
.PHONY: help env sim serve operate map test check format bench clean

help: ## List these targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

env: .venv/.env ## Make .venv with what running needs, in pinned versions

sim: .venv/.env ## Drive the robot in simulation (ARGS="--help" says what else)
	@$(BIN)/farsteer sim $(ARGS)

serve: .venv/.env ## Serve a robot on ws://127.0.0.1:9090 in real time (ARGS="--port 9091")
	@$(BIN)/farsteer serve $(ARGS)

operate: .venv/.env ## Operate it: display and keyboard (ARGS="ws://host:port --no-viewer --record x.rrd")
	@$(BIN)/farsteer operate $(ARGS)

map: .venv/.map ## Build the office's map from a simulated drive (ARGS="...")
	@$(BIN)/farsteer map office $(ARGS)

test: .venv/.dev ## Run all tests (ARGS="-m 'not slow'" for the quick ones)
	@tools/test-setup
	@OPENBLAS_NUM_THREADS=1 $(BIN)/pytest $(ARGS)

check: .venv/.dev ## Check format, lint, types and layers; changes nothing
	@$(BIN)/ruff format --check
	@$(BIN)/ruff check
	@$(BIN)/mypy
	@$(BIN)/lint-imports

format: .venv/.dev ## Format the code and mend what can be mended
	@$(BIN)/ruff format
	@$(BIN)/ruff check --fix

bench: .venv/.dev ## Run the benchmarks (ARGS="...")
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m benchmarks $(ARGS)

clean: ## Remove .venv and everything that was generated
	rm -rf .venv .cache .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The stamps are renewed only when what they depend on has changed.
.venv/.env: pyproject.toml constraints.txt
	@test -x $(BIN)/pip || { python=$$(tools/find-python $(PYTHON)) && $$python -m venv .venv; }
	$(BIN)/pip install --quiet --editable '.[sim,operator]'
	@touch $@

.venv/.map: .venv/.env
	$(BIN)/pip install --quiet --editable '.[sim,operator,map]'
	@touch $@

.venv/.dev: .venv/.env
	$(BIN)/pip install --quiet --editable '.[sim,operator,map,dev]'
	@touch $@
