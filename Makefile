# Everyday commands; `make help` lists them. Every build uses at most JOBS processes at once.
JOBS ?= 2
BUILD := build
CLI := $(BUILD)/bin/shellwarp
WHAT := all
FUZZ_SECONDS ?= 300
FUZZ_SANITIZER ?= none

MAKEFLAGS += --no-print-directory
export CARGO_BUILD_JOBS ?= $(JOBS)
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(JOBS)

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help build native demo test test-cargo test-c test-render header lint fuzz check-memory bench-precompute clean

help: ## list the targets
	@echo "usage: make TARGET [JOBS=2]"
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{ printf "%-20s %s\n", $$1, $$2 }'

build: ## build the library: target/release, or CARGO_TARGET_DIR/release
	cargo build --release

native: ## build the library and the command-line program by CMake, in build/
	@sh cmake/bootstrap.sh
	@. ./$(BUILD)/tools.sh && "$$CMAKE" -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release && \
	    "$$CMAKE" --build $(BUILD) --target $(WHAT)

demo: ## run the dinosaur, the beams, three handles and a dancer, and draw them: out/demo/*.png
	@$(MAKE) native WHAT=shellwarp_cli || { echo "demo: FAILED: the program could not be built"; exit 1; }
	@sh cmake/bootstrap.sh render || echo "demo: the renderer could not be installed (see above); going on without pictures"
	@. ./$(BUILD)/tools.sh && python3 host_examples/render/demo.py --cli $(CLI) --python "$$PYTHON" --out out/demo

test: ## run every test: Rust, then C and C++, then the renderer's; ends in test: OK or test: FAILED
	@failed=; \
	for suite in test-cargo test-c test-render; do \
	    echo "== $$suite"; $(MAKE) $$suite || failed="$$failed $$suite"; \
	done; \
	if [ -z "$$failed" ]; then echo "test: OK"; else echo "test: FAILED:$$failed"; exit 1; fi

test-cargo: ## run the Rust tests
	cargo test --release --no-fail-fast

test-c: native ## run the C and C++ tests (ctest)
	@. ./$(BUILD)/tools.sh && "$$CTEST" --test-dir $(BUILD) --output-on-failure --no-tests=error -j $(JOBS)

test-render: ## test the renderer, where cmake/bootstrap.sh render has set it up
	@if .venv/bin/python -c 'import mitsuba, numpy, PIL' 2>/dev/null; then \
	    .venv/bin/python -m unittest discover -s host_examples/render; \
	else \
	    echo "skipped: the renderer is not set up (sh cmake/bootstrap.sh render, or make demo)"; \
	fi

header: ## write include/shellwarp.h anew from the Rust sources
	UPDATE_HEADER=1 cargo test --release --test header

lint: ## check formatting and run clippy, warnings as errors
	cargo fmt --check
	cargo clippy --all-targets -- -D warnings

fuzz: ## search for inputs that break the library, FUZZ_SECONDS=300 over three targets (nightly Rust, cargo-fuzz)
	@sh tests/fuzz/search.sh $(FUZZ_SECONDS) $(FUZZ_SANITIZER)

check-memory: ## run the C and C++ tests under valgrind (memcheck; helgrind and drd where threads are)
	@$(MAKE) native WHAT=check_memory_programs
	@sh tests/c/check_memory.sh $(BUILD)/tests/c

bench-precompute: build ## time the precompute against scipy's eigensolver
	@sh cmake/bootstrap.sh bench
	.venv/bin/python tests/bench/precompute_vs_scipy.py

clean: ## remove what was built and drawn; .venv/ and compiled dependencies stay
	rm -rf $(BUILD) out
	cargo clean --package shellwarp
	cargo clean --package shellwarp --release
