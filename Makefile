# Everyday commands; `make help` lists them. Every build uses at most JOBS processes at once.
JOBS ?= 2
BUILD := build
CLI := $(BUILD)/bin/shellwarp
WHAT := all
FUZZ_SECONDS ?= 300
FUZZ_SANITIZER ?= none
PREFIX ?= /usr/local
# Seconds until a test of ctest counts as hung: no test is judged by the clock.
PATIENCE := 3600

MAKEFLAGS += --no-print-directory
export CARGO_BUILD_JOBS ?= $(JOBS)
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(JOBS)

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help build native demo test test-bare test-cargo test-c test-render test-blender demo-blender install package blender-addon header \
    python-abi docs-api test-docs lint fuzz check-memory check-threads check-miri check-guard bench bench-assets bench-auto-steps bench-binding bench-bounded bench-contact bench-contact-peers bench-correction bench-dynamics bench-front bench-fronts bench-handles bench-judging bench-instructions bench-leave-out bench-looks bench-polynomial bench-precompute bench-same-bits bench-small-loads bench-solver bench-training build-report report report-docs report-stability \
    test-report clean
.PHONY: npm release-check release-facts theory-pictures contact-pictures dist test-dist test-platforms dist-again render-mesh-picture proxy-picture moving-supports-picture materials-picture maya-module houdini-package plugin-zip cli check-platforms wasm test-wasm playground test-playground page-pictures tutorial-pictures docs scene-schema notices wheel pictures bench-leaf farm-demo farm-sweep farm-costs bench-slepc

help: ## list the targets
	@echo "usage: make TARGET [JOBS=2]"
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{ printf "%-20s %s\n", $$1, $$2 }'

build: ## build the library: target/release, or CARGO_TARGET_DIR/release
	cargo build --locked --release

native: ## build all that CMake builds, plug-ins and tests too, in build/
	@sh cmake/bootstrap.sh
	@. ./$(BUILD)/tools.sh && "$$CMAKE" -S . -B $(BUILD) -DCMAKE_BUILD_TYPE=Release && \
	    "$$CMAKE" --build $(BUILD) --target $(WHAT)

cli: ## build the library and the command-line program alone: build/lib, build/bin
	@$(MAKE) native WHAT=shellwarp_cli

demo: ## run the paper's scenes, draw and plot them: out/demo/*.png
	@echo "demo: about ten minutes on two cores, five more where nothing is built yet; a first picture as soon as the program is there"
	@$(MAKE) native WHAT=shellwarp_cli || { echo "demo: FAILED: the program could not be built"; exit 1; }
	@python3 host_examples/render/demo.py --cli $(CLI) --out out/demo --first
	@sh cmake/bootstrap.sh render || echo "demo: the renderer could not be installed (see above); going on without pictures"
	@. ./$(BUILD)/tools.sh && python3 host_examples/render/demo.py --cli $(CLI) --python "$$PYTHON" --out out/demo

pictures: ## make the README's animation: docs/pictures/shellwarp.webp
	@$(MAKE) native WHAT=shellwarp_cli
	@sh cmake/bootstrap.sh pictures
	@.venv/bin/python host_examples/render/pictures.py --cli $(CLI) --out docs/pictures/shellwarp.webp

tutorial-pictures: ## draw the pictures of docs/tutorials from what the tests tutorial_… left in build/
	@sh cmake/bootstrap.sh pictures
	.venv/bin/python host_examples/render/tutorial_pictures.py --ran $(BUILD)/tests/c/tutorials --out docs/tutorials/pictures

theory-pictures: cli ## measure and draw the pictures of docs/theory, two minutes
	@sh cmake/bootstrap.sh pictures python
	.venv/bin/python host_examples/render/theory_pictures.py --out docs/theory/pictures

render-mesh-picture: cli ## draw the picture of docs/guide/render_mesh.md
	@sh cmake/bootstrap.sh pictures
	.venv/bin/python host_examples/render/render_mesh_picture.py --cli $(BUILD)/bin/shellwarp --out docs/guide/pictures/render_mesh.png

proxy-picture: cli ## draw the picture of proxies in docs/guide/render_mesh.md
	@sh cmake/bootstrap.sh pictures
	.venv/bin/python host_examples/render/proxy_picture.py --cli $(BUILD)/bin/shellwarp --out docs/guide/pictures/proxies.png

contact-pictures: cli ## run and draw the picture of docs/guide/contact.md and of the report, two minutes
	@sh cmake/bootstrap.sh pictures
	.venv/bin/python host_examples/render/contact_pictures.py --cli $(BUILD)/bin/shellwarp --out docs/guide/pictures/contact.png

moving-supports-picture: cli ## draw the picture of docs/guide/moving_supports.md
	@sh cmake/bootstrap.sh pictures
	.venv/bin/python host_examples/render/moving_supports_picture.py --cli $(BUILD)/bin/shellwarp --out docs/guide/pictures/moving_supports.png

materials-picture: cli ## draw the pictures of docs/reference/materials.md
	@sh cmake/bootstrap.sh pictures
	.venv/bin/python host_examples/render/materials_picture.py --cli $(BUILD)/bin/shellwarp --out docs/reference/pictures

test: ## run every test; ends with what was skipped and how to get it, the counts, and test: OK or test: FAILED
	@MAKE="$(MAKE)" python3 tests/run_suites.py test-cargo test-c test-render test-report test-wasm test-playground test-bare

# The unit tests' library is compiled without optimization, in a sixth of the time. Rust's examples are of the benches.
UNIT := profile.release.package.shellwarp

test-cargo: ## run the Rust tests
	cargo test --locked --release --lib --config $(UNIT).opt-level=0 --config $(UNIT).overflow-checks=true
	cargo test --locked --release --no-fail-fast --test '*'
	cargo test --locked --release --package shellwarp-header

test-bare: ## run the tests of a library without its optional parts; the next build compiles the whole one anew
	cargo test --locked --release --no-default-features --test features

test-c: native ## run the C, C++ and Python tests (ctest)
	@sh cmake/bootstrap.sh python farm files docs || echo "test-c: the Python packages could not be installed (see above); their tests are skipped"
	@. ./$(BUILD)/tools.sh && "$$CTEST" --test-dir $(BUILD) --output-on-failure --no-tests=error --timeout $(PATIENCE) -j $(JOBS)

test-render: ## test the renderer, where cmake/bootstrap.sh render has set it up
	@if .venv/bin/python -c 'import matplotlib, mitsuba, numpy, PIL' 2>/dev/null; then \
	    .venv/bin/python -m unittest discover -s host_examples/render; \
	else \
	    echo "skipped: the renderer is not set up (sh cmake/bootstrap.sh render, or make demo)"; \
	fi

install: native ## install headers, libraries and the program: PREFIX=/usr/local
	@. ./$(BUILD)/tools.sh && "$$CMAKE" --install $(BUILD) --prefix "$(PREFIX)"

package: native ## pack the same into out/package/shellwarp-VERSION-SYSTEM.tar.gz, to be unpacked anywhere
	@. ./$(BUILD)/tools.sh && "$${CTEST%ctest}cpack" --config $(BUILD)/CPackConfig.cmake -B out/package

maya-module: ## pack the Maya plug-in as a module, with DEVKIT_LOCATION=devkitBase in the environment: out/maya/*.zip
	@$(MAKE) plugin-zip HOST=maya

houdini-package: ## pack the Houdini SOP as a package, with HFS in the environment: out/houdini/*.zip
	@$(MAKE) plugin-zip HOST=houdini

plugin-zip:
	@$(MAKE) native WHAT=shellwarp_$(HOST)_tree
	@for tree in $(BUILD)/$(HOST)/trees/*; do python3 cmake/pack.py "$$tree" "out/$(HOST)/$${tree##*/}.zip" || exit 1; done

# On Linux the wheel's library is that of the archives: linked for glibc 2.17, so that it runs on systems of 2013 and later.
PORTABLE := linux-$(shell uname -m)

wheel: ## build the Python wheel, for glibc 2.17 and later on Linux, and test it in a clean environment: out/wheel
	@sh cmake/bootstrap.sh python $(if $(filter Linux,$(shell uname)),portable)
	rm -rf out/wheel
	$(if $(filter Linux,$(shell uname)),library=$$(python3 cmake/dist_platforms.py library $(PORTABLE)) && \
	    SHELLWARP_LIBRARY=$$library) .venv/bin/python host_examples/python/backend/shellwarp_wheel.py out/wheel
	SHELLWARP_WHEEL=$$(ls $(CURDIR)/out/wheel/*.whl) SHELLWARP_OLDEST_GLIBC=$(if $(filter Linux,$(shell uname)),2.17) \
	    .venv/bin/python host_examples/python/tests/test_wheel.py

dist: ## make an archive for each platform that can be built for here, their checksums, and test them: out/dist (DEVKIT_LOCATION, HFS: with plug-ins)
	@sh cmake/bootstrap.sh portable
	python3 cmake/dist.py
	@$(MAKE) test-dist

test-dist: ## test the archives in out/dist: what is in them, and that outside projects build and run with them
	@sh cmake/bootstrap.sh python
	python3 tests/dist/test_dist.py

test-platforms: ## build the C, C++ and command-line tests for every platform and run them natively, under qemu or Wine; twenty minutes
	@sh cmake/bootstrap.sh
	@sh cmake/bootstrap.sh portable
	@JOBS=$(JOBS) python3 tests/dist/run_portable.py

dist-again: ## build the archives a second time in another folder, and list what differs
	python3 cmake/dist.py --again

# The order is that of the likeliest failures; what is not installed is skipped with its name.
RELEASE_SUITES := release-facts lint test bench-instructions test-blender wheel docs check-guard check-memory check-threads check-miri fuzz dist dist-again test-platforms

release-check: ## all that must hold before a release: facts, every test, sanitizers, FUZZ_SECONDS=3600 of fuzzing, archives twice, every platform; five hours
	@MAKE="$(MAKE)" FUZZ_SECONDS=$(if $(filter command line environment,$(origin FUZZ_SECONDS)),$(FUZZ_SECONDS),3600) \
	    python3 tests/run_suites.py --name release-check --log $(BUILD)/release-logs $(RELEASE_SUITES)

release-facts:
	@python3 cmake/release_facts.py

check-platforms: ## compile for every platform whose Rust target is installed, and write docs/reference/platforms.md
	@python3 tests/check_platforms.py

WASM := $(or $(CARGO_TARGET_DIR),target)/wasm32-unknown-unknown/release/shellwarp.wasm

wasm: ## build the library as a WebAssembly module with SIMD, where the target is installed (rustup target add wasm32-unknown-unknown)
	python3 cmake/dist_platforms.py module

# A page that needs no server: the library, its workers, five shells and their saved models in one file.
PLAYGROUND := host_examples/playground
PAGE_OF := $(BUILD)/playground

playground: ## write the page where shells are dragged, with npm and the wasm target: build/playground/index.html
	@command -v npm >/dev/null || { echo "playground: npm is missing"; exit 1; }
	@rustup target list --installed | grep -q wasm32-unknown-unknown || \
	    { echo "playground: run rustup target add wasm32-unknown-unknown first"; exit 1; }
	@$(MAKE) wasm
	npm ci --silent --prefix $(PLAYGROUND)
	@mkdir -p $(PAGE_OF)
	python3 host_examples/npm/layout.py include/shellwarp.h >$(PAGE_OF)/layout.json
	node $(PLAYGROUND)/make.mjs $(WASM) $(PAGE_OF)/layout.json $(PAGE_OF) $(FOR_TESTS)

test-playground: ## drag its shells in headless Chromium; skipped where npm, the wasm target or a browser is missing
	@if ! command -v npm >/dev/null; then echo "skipped: the playground: npm is missing (install node)"; \
	elif ! rustup target list --installed 2>/dev/null | grep -q wasm32-unknown-unknown; then \
	    echo "skipped: the playground: rustup target add wasm32-unknown-unknown"; \
	else $(MAKE) playground PAGE_OF=$(BUILD)/playground-tests FOR_TESTS=--for-tests && \
	    node $(PLAYGROUND)/test_page.mjs $(BUILD)/playground-tests/index.html; fi

PAGES := out/pages
page-pictures: cli docs ## take the docs' pictures of pages: player, playground, docs site, and the report where it was made; with Chromium
	@$(MAKE) playground PAGE_OF=$(BUILD)/playground-tests FOR_TESTS=--for-tests
	@mkdir -p $(PAGES) && cd $(PAGES) && rm -f leaf.* && $(CURDIR)/$(CLI) new-scene leaf.toml
	$(CLI) run $(PAGES)/leaf.toml --compare warp,shell-implicit --html $(PAGES)/player.html
	node $(PLAYGROUND)/test_page.mjs $(BUILD)/playground-tests/index.html $(PAGES)
	node $(PLAYGROUND)/page_pictures.mjs $(PAGES) $(PAGES)/player.html out/docs/index.html out/report/index.html
	cp $(PAGES)/pulled_over.png docs/guide/pictures/playground.png
	cp $(PAGES)/player.png docs/guide/pictures/player.png
	cp $(PAGES)/docs_site.png docs/guide/pictures/docs_site.png
	if test -f $(PAGES)/report.png; then cp $(PAGES)/report.png docs/evidence/report/opening.png; fi

# What the module's users need beside it: offsets of fields, and types.
MODULE := $(BUILD)/module

npm: wasm ## make the npm package in out/npm/shellwarp, and out/npm/shellwarp-VERSION.tgz
	@mkdir -p $(MODULE) out/npm
	python3 host_examples/npm/layout.py include/shellwarp.h >$(MODULE)/layout.json
	python3 host_examples/npm/layout.py include/shellwarp.h --types >$(MODULE)/descriptors.d.ts
	node host_examples/npm/make.mjs $(WASM) $(MODULE)/layout.json $(MODULE)/descriptors.d.ts out/npm/shellwarp
	npm pack --silent --pack-destination out/npm ./out/npm/shellwarp

test-wasm: ## test that module and the npm package in node; skipped where node or the wasm target is missing
	@if ! command -v npm >/dev/null; then echo "skipped: WebAssembly: node and npm are missing"; \
	elif ! rustup target list --installed 2>/dev/null | grep -q wasm32-unknown-unknown; then \
	    echo "skipped: WebAssembly: rustup target add wasm32-unknown-unknown"; \
	else npm ci --silent --prefix host_examples/npm || echo "skipped: types of the npm package: npm could not install typescript"; \
	    mkdir -p $(BUILD)/dist; \
	    $(MAKE) npm && SHELLWARP_WASM=$(WASM) SHELLWARP_LAYOUT=$(MODULE)/layout.json SHELLWARP_NPM=out/npm/shellwarp \
	    node --test --test-reporter=tap --test-reporter-destination=stdout \
	    --test-reporter=tap --test-reporter-destination=$(BUILD)/dist/wasm.tap tests/wasm/; fi

demo-blender: blender-addon ## make, bake, export and draw the scenes of docs/guide/blender.md: out/blender
	@sh cmake/bootstrap.sh blender
	for scene in first character contact follow hat; do \
	    BLENDER_USER_RESOURCES=$(CURDIR)/$(BUILD)/blender-user .venv/blender/bin/python \
	        host_examples/blender/$${scene}_scene.py --addon out/blender/shellwarp-blender-*.zip --out out/blender || exit 1; \
	done

blender-addon: native ## pack the Blender add-on: out/blender/*.zip
	python3 host_examples/blender/build_addon.py

test-blender: native ## install Blender as a Python module (1 GB) and test the add-on in it
	@sh cmake/bootstrap.sh blender
	@. ./$(BUILD)/tools.sh && "$$CTEST" --test-dir $(BUILD) --output-on-failure --no-tests=error --timeout $(PATIENCE) -L blender

FARM = PYTHONPATH=$(CURDIR)/host_examples/python:$(CURDIR)/host_examples/farm .venv/bin/python

farm-demo: native ## bake 200 jobs on one and two workers, kill and resume them: out/farm
	@sh cmake/bootstrap.sh farm
	@$(FARM) host_examples/farm/demo.py --out out/farm

farm-sweep: native ## error against run time over meshes, materials and loads: out/farm/sweep
	@sh cmake/bootstrap.sh farm
	@$(FARM) -m shellwarp_farm sweep host_examples/farm/lists/sweep.toml --out out/farm/sweep

farm-costs: native ## time and memory by vertices and modes: out/farm/costs/costs.md
	@sh cmake/bootstrap.sh farm
	@$(FARM) -m shellwarp_farm costs --out out/farm/costs

bench-slepc: ## the precompute's eigenvalues against SLEPc's, where the system's python3 has slepc4py
	@/usr/bin/python3 tests/bench/slepc_check.py

header: ## write include/shellwarp.h anew from the Rust sources, Python's declarations and the API page from it (FIRST=1: and tests/growth/first)
	UPDATE_HEADER=1 cargo test --locked --release --package shellwarp-header header_is_current
	@$(MAKE) python-abi docs-api
	$(if $(FIRST),cp include/shellwarp.h tests/c/struct_layout.def tests/growth/first/)

docs-api: ## write docs/reference/api.md anew from include/shellwarp.h
	python3 docs/reference/api_page.py include/shellwarp.h >$(BUILD)-api.tmp
	mv $(BUILD)-api.tmp docs/reference/api.md

python-abi: ## write the Python package's declarations anew from include/shellwarp.h
	python3 host_examples/python/generate_abi.py include/shellwarp.h >$(BUILD)-abi.tmp
	mv $(BUILD)-abi.tmp host_examples/python/shellwarp/_abi.py

test-docs: ## test that links and names of the pages lead somewhere, and that the API page is current
	@python3 -m unittest discover -s tests/docs

scene-schema: ## write docs/reference/scene.schema.json anew, from docs/reference/scene.md and the command-line program
	@$(MAKE) native WHAT=shellwarp_cli
	.venv/bin/python tests/docs/scene_schema.py $(CLI) --write
	@$(MAKE) native WHAT=shellwarp_cli

notices: ## write THIRD_PARTY.md anew: the licences of all that the binaries contain
	python3 cmake/third_party.py

docs: ## build the pages as a site that needs no network: out/docs/index.html
	@sh cmake/bootstrap.sh docs
	NO_MKDOCS_2_WARNING=1 .venv/bin/python -m mkdocs build --quiet
	@echo "docs: out/docs/index.html"

lint: test-docs ## check links and formatting, and run clippy, warnings as errors
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	cargo clippy --locked --no-default-features --lib --test features -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps
	@sh tests/check_dependencies.sh
	@python3 cmake/third_party.py --check

bench: ## time the kernels beside their floors: this machine's section of docs/evidence/speed.md, its plots, out/report/kernels.csv
	@mkdir -p out/report
	cargo bench --locked --bench kernels -- --docs docs/evidence/speed.md --csv out/report/kernels.csv
	cargo build --locked --release --package shellwarp-report
	$(RELEASE)/shellwarp-report --kernels --docs docs/evidence

bench-instructions: ## count the kernels' instructions under valgrind against those checked in (UPDATE=1: check in these)
	python3 tests/bench/instructions.py $(if $(UPDATE),--update)

fuzz: ## search for inputs that break the library, FUZZ_SECONDS=300 over six targets (nightly Rust, cargo-fuzz)
	@sh tests/fuzz/search.sh $(FUZZ_SECONDS) $(FUZZ_SANITIZER)

check-memory: ## run the C and C++ tests under valgrind (memcheck; helgrind and drd where threads are)
	@$(MAKE) native WHAT=check_memory_programs
	@sh tests/c/check_memory.sh $(BUILD)/tests/c

check-threads: ## run what shares models and states among threads under ThreadSanitizer (nightly Rust, rust-src)
	RUSTFLAGS=-Zsanitizer=thread cargo +nightly test --locked --release -Zbuild-std --target $$(rustc -vV | sed -n 's/^host: //p') \
	    --target-dir target/thread --test threads --test determinism

check-miri: ## load a saved model, step, hold, save and clone under Miri (nightly Rust, miri)
	MIRIFLAGS='-Zmiri-disable-isolation -Zmiri-deterministic-floats' \
	    cargo +nightly miri test --locked --target-dir target/miri --test determinism a_run_in_parts

check-guard: ## compare the scenes' motion, byte for byte, with that of a library without the guard against loads beyond range
	@$(MAKE) native WHAT=shellwarp_cli
	@sh tests/check_guard.sh $(CLI) $(CURDIR)/out/guard

bench-front: ## error of reduced shells on loads they were not trained on, the figures of docs/evidence/front.md (references stay in out/front)
	cargo run --locked --release --example front -- --docs docs/evidence/front.md

bench-fronts: ## error against the time of a frame, method by method, on seven shells: docs/evidence/front.md, fronts.csv and their picture
	cargo run --locked --release --example front -- --times --docs docs/evidence/front.md
	python3 tests/bench/fronts_picture.py

bench-judging: ## error of what SW_METHOD_AUTO takes on the judging list of tests/bench/front/judging.rs: docs/evidence/front.md
	cargo run --locked --release --example front -- --judge --docs docs/evidence/front.md

bench-bounded: ## 10^6 steps of the polynomial shell under wild loads: docs/evidence/front.md
	cargo run --locked --release --example bounded -- --docs docs/evidence/front.md

bench-dynamics: ## flips, releases and handles let go against the full shell in short steps: docs/evidence/front.md
	cargo run --locked --release --example dynamics -- --docs docs/evidence/front.md

bench-handles: ## shells that handles lead, which the precompute was told, against the full shell: docs/evidence/front.md
	cargo run --locked --release --example handles -- --docs docs/evidence/front.md

bench-small-loads: build ## ten shells under loads that are small beside those of their training, against the full shell: docs/evidence/front.md
	@sh cmake/bootstrap.sh python
	SHELLWARP_LIBRARY=$(LIBRARY) .venv/bin/python tests/bench/small_loads.py --docs docs/evidence/front.md

bench-looks: build ## what a training within a second costs in error, and how long bowls train: docs/evidence/training.md
	@sh cmake/bootstrap.sh python
	SHELLWARP_LIBRARY=$(LIBRARY) .venv/bin/python tests/bench/looks.py --docs docs/evidence/training.md

bench-auto-steps: build ## what a step costs where SW_METHOD_AUTO is the full shell: docs/guide/methods.md
	@sh cmake/bootstrap.sh python
	SHELLWARP_LIBRARY=$(LIBRARY) .venv/bin/python tests/bench/auto_steps.py --docs docs/guide/methods.md

bench-solver: ## count factorizations of the full shell's equilibria and steps: docs/evidence/solver.md
	cargo run --locked --release --example solver -- --docs docs/evidence/solver.md

bench-correction: ## error of a reduced shell after Newton steps of the full one: docs/evidence/solver.md
	cargo run --locked --release --example correction -- --docs docs/evidence/solver.md
	cargo run --locked --release --example correction -- --docs docs/evidence/solver.md frames
	cargo run --locked --release --example correction -- --docs docs/evidence/solver.md motion

bench-training: ## time the training of reduced shells, a table of docs/evidence/training.md
	cargo run --locked --release --example training -- --docs docs/evidence/training.md

bench-polynomial: ## time the polynomial shell's steps and positions beside the warp's on leaves (models stay in out/bench)
	cargo run --locked --release --example polynomial

bench-contact: ## time frames of the warp among colliders beside free ones: docs/evidence/speed.md
	cargo run --locked --release --example contact -- --docs docs/evidence/speed.md

bench-contact-peers: build ## time a sheet that falls onto a ball beside MuJoCo, Newton and Blender, where they are installed: docs/evidence/speed.md
	@sh cmake/bootstrap.sh bench cloth || echo "bench-contact-peers: going on with the peers that there are"
	SHELLWARP_LIBRARY=$(LIBRARY) .venv/bin/python tests/bench/contact_peers.py --docs docs/evidence/speed.md

bench-assets: ## compare proxies with their assets simulated themselves: docs/evidence/assets.md
	cargo run --locked --release --example assets -- --docs docs/evidence/assets.md

bench-binding: ## time points that follow a shell beside the positions of as many vertices: docs/evidence/speed.md
	cargo run --locked --release --example binding -- --docs docs/evidence/speed.md

bench-same-bits: ## time deterministic states beside plain ones: docs/evidence/speed.md
	cargo run --locked --release --example same_bits -- --docs docs/evidence/speed.md

bench-leave-out: ## what scenes pay for what they do not use, by valgrind: docs/evidence/leave_out.md
	python3 tests/bench/leave_out.py --docs docs/evidence/leave_out.md

bench-leaf: ## error against time, method by method, on one leaf: docs/evidence/leaf_front.csv and the README's plot
	@$(MAKE) native WHAT=shellwarp_cli
	@sh cmake/bootstrap.sh python
	.venv/bin/python tests/bench/leaf_front.py

bench-precompute: build ## time the precompute by phases, and against scipy's eigensolver: this machine's sections of docs/evidence/speed.md
	@sh cmake/bootstrap.sh bench
	cargo run --locked --release --quiet --example precompute -- table 1 1000 13117 100000 --docs docs/evidence/speed.md
	.venv/bin/python tests/bench/precompute_vs_scipy.py --docs docs/evidence/speed.md

# The report's page: its player is bundled by npm, its peers run in .venv/; what is missing is left out with a line.
RELEASE = $(or $(CARGO_TARGET_DIR),target)/release
LIBRARY = $(RELEASE)/$(if $(filter Darwin,$(shell uname)),libshellwarp.dylib,libshellwarp.so)
REPORT = $(RELEASE)/shellwarp-report --library $(LIBRARY) --python .venv/bin/python \
    $$(test -s $(BUILD)/viewer.js && echo --viewer $(BUILD)/viewer.js) $(if $(QUICK),--quick) $(if $(FRESH),--fresh)
PAGE := tests/report/page

$(BUILD)/viewer.js: $(PAGE)/viewer.js $(PAGE)/package-lock.json
	@mkdir -p $(BUILD)
	@if command -v npm >/dev/null; then \
	    npm ci --silent --prefix $(PAGE) && npm run --silent --prefix $(PAGE) build >$@.part && mv $@.part $@; \
	else echo "report: npm is missing; the page will have no player"; fi

# Both at once, so that cargo chooses the same dependencies for the library and for the program that loads it.
build-report:
	cargo build --locked --release --package shellwarp --package shellwarp-report

report: build-report $(BUILD)/viewer.js ## measure errors and run times of every method: out/report/index.html (QUICK=1: two minutes)
	@$(if $(QUICK),:,sh cmake/bootstrap.sh bench cloth || echo "report: going on without peers (see above)")
	$(REPORT)

report-docs: build-report $(BUILD)/viewer.js ## the same from scratch, and write docs/evidence/error_and_speed.md; on an idle machine
	@sh cmake/bootstrap.sh bench cloth || echo "report: going on without peers (see above)"
	$(REPORT) --fresh --docs docs/evidence

report-stability: build-report ## map where each method holds: out/report/stability.csv and docs/evidence/stability.md
	@$(MAKE) native WHAT=shellwarp_cli || echo "report-stability: no command-line program; 32 against 64 bits is left out"
	$(RELEASE)/shellwarp-report --library $(LIBRARY) --stability --docs docs/evidence $$(test -x $(CLI) && echo --cli $(CLI))

test-report: build-report ## test the report's arithmetic, that a small run repeats to the digit, and its page where a browser is installed
	cargo test --locked --release --quiet --package shellwarp-report
	@$(MAKE) $(BUILD)/viewer.js || true
	$(REPORT) --smoke --out out/report-smoke
	@cp out/report-smoke/errors.csv out/report-smoke/errors_before.csv
	$(REPORT) --smoke --out out/report-smoke
	@cmp out/report-smoke/errors.csv out/report-smoke/errors_before.csv
	@tests/report/page/test.sh out/report-smoke

clean: ## remove what was built and drawn; .venv/ and compiled dependencies stay
	rm -rf $(BUILD) out
	cargo clean --package shellwarp
	cargo clean --package shellwarp --release
