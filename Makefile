# Daily work
#   make check   checks formatting, ruff, mypy, cargo check and links in the Rust documentation: half a minute
#   make lint    checks formatting, clippy, ruff, mypy, stubs and types of the JavaScript; warnings are errors
#   make test    runs the checks of CI: the linters, then every test in its short form
#   make proof   runs the slow tests too: rays aimed at edges, brute force over many meshes, jobs killed at every step,
#                collections of files, examples
#
# Results to view
#   make demo    renders images and a video into demo/
#   make docs    builds the documentation in docs/_build/html
#   make web     builds raycam as WebAssembly for live pages, in python/raycam/viewer/web/wasm/
#
# Measurements
#   make bench   measures the figures in benchmarks/results/
#   make leak    aims a thousand million rays at edges and vertices; none may pass through. Compares with Embree
#   make fuzz    passes damaged files to each reader for a minute; requires nightly Rust and cargo-fuzz
#
# Releases
#   make wheel   builds a wheel for this machine and the source archive, in dist/
#   make smoke   installs the wheel and the source archive into empty environments, and renders with them
#   make wheels  builds all wheels that can be built on Linux, and the source archive, in dist/: about half an hour
#   make check-wheels  checks the files in dist/ for the package index, and renders with this machine's wheel
#   make clean   removes all build outputs
#
# Each target installs what it needs into .venv. PYTHON selects the interpreter that creates .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DONE := $(VENV)/done

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

# Every build uses the same interpreter; otherwise, cargo would rebuild the bindings for each interpreter.
export PYO3_PYTHON := $(abspath $(BIN)/python)
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# nextest runs the tests of all crates in parallel; without it, cargo's own runner is used.
CARGO_TEST := $(shell cargo nextest --version >/dev/null 2>&1 && echo 'cargo nextest run --locked && cargo test --locked --doc' || echo cargo test --locked)

# Before any build, .ci/prerequisites writes this file, which selects the toolchain.
ifneq ($(filter-out help clean,$(MAKECMDGOALS)),)
include $(DONE)/toolchain.mk
endif

RUST_SOURCES := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock

.PHONY: help check lint test proof demo web bench leak fuzz docs wheel smoke wheels check-wheels clean

help:
	@sed -n '/^PYTHON/q;s/^# \{0,1\}//p' Makefile

check: $(DONE)/lint
	cargo fmt --check
	cargo check --locked --workspace --all-targets
	RUSTDOCFLAGS=-Dwarnings cargo doc --locked --workspace --no-deps --document-private-items
	.ci/web check
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

lint: $(DONE)/build $(DONE)/develop
	cargo fmt --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	.ci/web check
	.ci/client $(VENV)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest raycam._core

test: lint
	$(CARGO_TEST)
	$(BIN)/python -m pytest -n 2 --durations=20

proof: $(DONE)/build $(DONE)/judges
	RAYCAM_PROOF=1 cargo test --locked
	$(BIN)/python -m pytest -n 2 --durations=20 -m 'proof or not proof'

demo: $(DONE)/build
	$(BIN)/raycam demo demo

web: $(DONE)/toolchain.mk
	.ci/web build $(VENV)

bench: $(DONE)/release $(DONE)/develop
	@for script in benchmarks/bench_*.py benchmarks/embree_race.py; do echo "== $$script"; $(BIN)/python $$script; done

leak: $(DONE)/develop
	$(BIN)/python benchmarks/leaks.py

# For a long run: SECONDS_EACH=3600 make fuzz. Findings are written to fuzz/artifacts/.
fuzz:
	$(PYTHON) fuzz/seeds.py
	cargo +nightly fuzz build --fuzz-dir fuzz -s none
	@for target in $$(cargo +nightly fuzz list --fuzz-dir fuzz); do echo "== $$target"; \
	    cargo +nightly fuzz run --fuzz-dir fuzz -s none $$target -- -max_total_time=$${SECONDS_EACH:-60} \
	    -timeout=10 -rss_limit_mb=1024 -malloc_limit_mb=256 -max_len=16384 -print_final_stats=1; done

docs: $(DONE)/build $(DONE)/documentation
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html

wheel: $(DONE)/builder
	rm -rf dist
	$(PYTHON) .ci/third_party.py --texts
	$(BIN)/maturin build --release --locked --sdist --out dist; status=$$?; $(PYTHON) .ci/third_party.py; exit $$status

# The source archive is compiled too; it reuses the third-party crates that `make wheel` compiled.
smoke: export CARGO_TARGET_DIR ?= $(abspath target)
smoke: wheel
	.ci/smoke dist $(abspath $(BIN)/python)
	.ci/smoke --source dist $(abspath $(BIN)/python)

# zig is the linker for other systems. The Windows wheel requires mingw: apt install gcc-mingw-w64-x86-64.
ZIG := --zig --compatibility
# maturin finds the package ziglang through the Python on PATH.
wheels: export PATH := $(abspath $(BIN)):$(PATH)
wheels: $(DONE)/cross
	rm -rf dist
	$(PYTHON) .ci/third_party.py --texts
	for machine in x86_64 aarch64; do \
	    $(BIN)/maturin build --release --locked $(ZIG) manylinux2014 --target $$machine-unknown-linux-gnu --out dist; \
	    $(BIN)/maturin build --release --locked $(ZIG) musllinux_1_2 --target $$machine-unknown-linux-musl --out dist; \
	    $(BIN)/maturin build --release --locked --zig --target $$machine-apple-darwin --out dist; done
	$(BIN)/maturin build --release --locked --target x86_64-pc-windows-gnu --out dist
	$(BIN)/maturin sdist --out dist
	$(PYTHON) .ci/third_party.py

check-wheels: $(DONE)/cross
	$(PYTHON) .ci/third_party.py --check
	$(BIN)/twine check --strict dist/*
	$(BIN)/abi3audit --strict dist/*.whl
	$(BIN)/check-wheel-contents dist/*.whl
	$(BIN)/auditwheel show dist/*manylinux*x86_64*.whl
	.ci/smoke dist

clean:
	rm -rf $(VENV) target dist docs/_build docs/_generated docs/reference/api demo python/raycam/*.so
	find . -name __pycache__ -prune -exec rm -rf {} +

# Installations. Each creates a stamp file, so that it runs only once.

$(DONE)/toolchain.mk: .ci/prerequisites Cargo.toml
	@PYTHON=$(PYTHON) .ci/prerequisites $(VENV)

$(DONE)/builder: $(DONE)/toolchain.mk pyproject.toml
	$(BIN)/python -m pip install -q --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install -q --group build
	@touch $@

$(DONE)/lint: $(DONE)/builder
	$(BIN)/python -m pip install -q --group lint
	@touch $@

$(DONE)/develop: $(DONE)/builder
	$(BIN)/python -m pip install -q --group dev
	@touch $@

# Programs of others that read data sets in `make proof`. nuscenes-devkit requires NumPy 1, but runs with NumPy 2.
$(DONE)/judges: $(DONE)/develop
	$(BIN)/python -m pip install -q --group judges
	$(BIN)/python -m pip install -q --no-deps 'nuscenes-devkit>=1.2'
	@touch $@

$(DONE)/cross: $(DONE)/builder
	$(BIN)/python -m pip install -q --group release
	rustup target add $(foreach machine,x86_64 aarch64,$(machine)-unknown-linux-gnu $(machine)-unknown-linux-musl $(machine)-apple-darwin) x86_64-pc-windows-gnu
	@touch $@

$(DONE)/documentation: $(DONE)/builder
	$(BIN)/python -m pip install -q --group docs
	@touch $@

# The extension is built with the profile of the Rust tests, so that both share one compilation.
$(DONE)/build: $(DONE)/builder $(RUST_SOURCES)
	rm -f python/raycam/_core*.so $(DONE)/release
	$(BIN)/maturin develop -q --locked
	@touch $@

# For measurements, the extension is built as in a wheel: optimised across crates.
$(DONE)/release: $(DONE)/builder $(RUST_SOURCES)
	rm -f python/raycam/_core*.so $(DONE)/build
	$(BIN)/maturin develop -q --release --locked
	@touch $@
