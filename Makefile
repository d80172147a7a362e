# `make help` says what there is. Needs Python >= 3.10, a Rust toolchain and a package index; the rest is fetched into .venv/.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
# maturin would ask which of two environments is meant when a conda one is active.
MATURIN := env -u CONDA_PREFIX VIRTUAL_ENV="$(CURDIR)/$(VENV)" $(BIN)/maturin develop --quiet --release --locked
# cargo builds the Python crate against this interpreter, outside maturin too.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_QUIET := 1

SOURCES := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock pyproject.toml

.DEFAULT_GOAL := help
.PHONY: help build demo test check bench docs clean

help: ## this list
	@echo "truefield: distance fields that people can trust. Targets:"
	@grep -E '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## (.*)/  make \1|\2/' | awk -F'|' '{ printf "%-14s %s\n", $$1, $$2 }'
	@echo "Variables: PYTHON=/path/to/python (3.10 or newer), MODELS=DIR and ARGS=... for bench"

build: $(VENV)/.built ## set up .venv/ and build the extension module into it

demo: build ## make a casting-like part and find its heavy sections and wall thickness
	@mkdir -p demo
	@$(BIN)/python -c "import truefield as tf; part = tf.shapes.housing(); part.write('demo/housing.stl'); \
	  print(f'demo/housing.stl: {len(part.triangles)} triangles')"
	$(BIN)/truefield thickness demo/housing.stl --above 10 --tolerance 0.05 --output demo/report/
	@echo "The demo wrote demo/housing.stl and, in demo/report/:" && ls -1 demo/report/ | sed 's/^/  /'

test: build ## all tests, Rust and Python
	cargo test --workspace --locked
	$(BIN)/python -m pytest

check: build ## format, lints, types, stubs and the arrows between modules
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest truefield._truefield
	cargo test --locked -p truefield --test arrows

bench: build $(VENV)/.peers ## compare with other tools (MODELS=DIR for your own models, ARGS=--help for the options)
	$(BIN)/python -m bench $(if $(MODELS),--models "$(MODELS)") $(ARGS)

docs: build ## reference pages into target/doc/
	RUSTDOCFLAGS="-D warnings" cargo doc --quiet --locked --no-deps -p truefield
	@mkdir -p target/doc/python && cd target/doc/python && "$(CURDIR)/$(BIN)/python" -m pydoc -w truefield truefield.shapes >/dev/null
	@echo "Rust: target/doc/truefield/index.html   Python: target/doc/python/truefield.html"

clean: ## remove everything that was built or fetched
	rm -rf $(VENV) target demo bench/results

# A virtual environment with the build tool, once.
$(VENV)/.tools:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { \
	  echo "error: '$(PYTHON)' is missing or older than Python 3.10; install one, or name it: make PYTHON=/path/to/python" >&2; exit 1; }
	@command -v cargo >/dev/null || { echo "error: cargo is missing; install a Rust toolchain (1.89 or newer) first" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
	  echo "error: '$(PYTHON) -m venv' failed; some systems ship it as a separate package (python3-venv)" >&2; exit 1; }
	$(BIN)/python -m pip install --quiet 'maturin>=1.7,<2'
	@touch $@

# The package, what it needs and the developers' tools, as pyproject.toml lists them.
$(VENV)/.built: $(VENV)/.tools $(SOURCES)
	$(MATURIN) --extras dev
	@touch $@

# The peers of the "bench" extra, one by one: one that has no wheel here is listed as missing and must not stop the rest.
$(VENV)/.peers: pyproject.toml | $(VENV)/.built
	@$(BIN)/python -c "from importlib.metadata import requires; \
	  print(*[r.split(';')[0].strip() for r in requires('truefield') if 'bench' in r.partition(';')[2]], sep='\n')" | \
	  while read -r peer; do $(BIN)/python -m pip install --quiet "$$peer" || \
	  echo "$$peer does not install here and will be listed as missing" >&2; done
	@touch $@
