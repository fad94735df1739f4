# The only list of commands: the README, the hooks and .ci/run call these targets and nothing beneath them.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.NOTPARALLEL:

VENV := $(CURDIR)/.venv
OLDEST := $(CURDIR)/.venv-oldest
ZOO := $(CURDIR)/.venv-zoo
RLLIB := $(CURDIR)/.venv-rllib
RERUN := $(CURDIR)/.venv-rerun
export VIRTUAL_ENV := $(VENV)
export PATH := $(VENV)/bin:$(PATH)
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# maturin refuses to choose between two environments.
unexport CONDA_PREFIX PYTHONHOME

# $(call need,FOLDER,NAME ...): makes the venv, and installs requirements/NAME.txt unless it was installed as it is now.
define need
	@$(1)/bin/python -c 'import pip' 2>/dev/null || python3 -m venv --clear $(1)
	@mkdir -p $(1)/requirements
	@for name in $(2); do \
	  if ! cmp -s requirements/$$name.txt $(1)/requirements/$$name.txt; then \
	    echo "installing requirements/$$name.txt"; \
	    $(1)/bin/python -m pip install $(if $(CI),--quiet) -r requirements/$$name.txt || exit 1; \
	    cp requirements/$$name.txt $(1)/requirements/$$name.txt; \
	  fi; \
	done
endef

# Release builds name no folder of this machine: the one that holds the sources of the dependencies reads as /crates.
# Every release build uses this, since another RUSTFLAGS compiles everything again.
REMAP = $$(printf -- '--remap-path-prefix=%s=/crates ' "$${CARGO_HOME:-$$HOME/.cargo}"/registry/src/*)
RELEASE = cargo fetch --quiet --locked && RUSTFLAGS="$${RUSTFLAGS:-} $(REMAP)"

.PHONY: help
help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  %-22s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

.PHONY: tools
tools:
	@command -v cargo >/dev/null || { echo "swath needs cargo, which comes with Rust: https://rustup.rs" >&2; exit 1; }
	@command -v python3 >/dev/null || { echo "swath needs python3, version 3.10 or newer" >&2; exit 1; }
	@python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' \
	  || { echo "swath needs Python 3.10 or newer, and this is $$(python3 --version 2>&1)" >&2; exit 1; }
	@python3 -c 'import ensurepip, venv' 2>/dev/null \
	  || { echo "swath needs Python's venv module: install the package python3-venv" >&2; exit 1; }

.PHONY: setup
setup: tools ## everything for working on swath: the venv, the pinned tools, the git hooks, a build
	$(call need,$(VENV),$(PACKAGES) dev)
	@if git rev-parse --git-dir >/dev/null 2>&1; then prek install; fi
	@$(MAKE) --no-print-directory build

# All that `make lint` and `make test` need.
PACKAGES := lint build demo typing paper test

.PHONY: packages
packages: tools ## the Python packages of `make lint` and `make test`, without a build
	$(call need,$(VENV),$(PACKAGES))

.PHONY: demo
demo: build-release ## the agents race on the shipped pastures: a table, pictures and a replay (snake.html) in out/demo
	python -m swath demo --out out/demo

# Inner loop

.PHONY: check
check: tools ## clippy on the daily crates
	cargo clippy --all-targets --locked -- -D warnings

.PHONY: fmt
fmt: tools ## format everything
	$(call need,$(VENV),lint)
	cargo fmt --all
	cargo fmt --manifest-path fuzz/Cargo.toml
	ruff format
	ruff check --fix
	RUST_LOG=warn taplo fmt

.PHONY: build
build: tools ## the extension in .venv, debug
	$(call need,$(VENV),build demo)
	@echo "debug build: do not time it"
	PIP_QUIET=1 maturin develop

.PHONY: build-release
build-release: tools ## the extension in .venv, release
	$(call need,$(VENV),build demo)
	$(RELEASE) PIP_QUIET=1 maturin develop --release

.PHONY: wheel
wheel: tools ## the wheel in target/wheels, checked for size and for paths of this machine
	$(call need,$(VENV),build demo)
	@rm -rf target/wheels
	$(RELEASE) maturin build --release --out target/wheels
	python scripts/check_wheel.py target/wheels/*.whl

.PHONY: wheel-server
wheel-server: build-release ## the server as a wheel in target/wheels-server, checked like the other, installed and run
	$(call need,$(VENV),typing test)
	@rm -rf target/wheels-server
	$(RELEASE) maturin build --release --manifest-path env-server/Cargo.toml --out target/wheels-server
	python scripts/check_wheel.py target/wheels-server/*.whl
	python -m pytest tests/python/test_server_wheel.py

# Tests

.PHONY: test
test: test-rust test-server test-py ## every test but the slow ones; LONG=1: those too, and more and other cases of properties

.PHONY: test-rust
test-rust: export PROPTEST_CASES := $(if $(LONG),2000,64)
ifndef LONG
test-rust: export PROPTEST_RNG_SEED := 0
endif
test-rust: tools ## the Rust tests; ARGS= filters, LONG=1: more cases, other ones each time
	@if cargo nextest --version >/dev/null 2>&1; then set -x; cargo nextest run --locked $(ARGS); \
	else set -x; cargo test --locked --lib --bins --tests $(ARGS); fi
	$(if $(ARGS),,cargo test --locked --doc)

.PHONY: server-release
server-release: tools ## the environment server for work, target/release/swath-server
	$(RELEASE) cargo build --release --locked -p swath-server

.PHONY: server
server: tools ## the environment server for tests, target/debug/swath-server
	cargo build --locked -p swath-server

# In one process the tests share Zenoh's threads, and some keep them.
.PHONY: test-server
test-server: tools ## the tests of the server, over the loopback; ARGS= filters
	@if cargo nextest --version >/dev/null 2>&1; then set -x; cargo nextest run --locked -p swath-server $(ARGS); \
	else set -x; RUST_TEST_THREADS=1 cargo test --locked -p swath-server $(ARGS); fi

.PHONY: test-py
test-py: export HYPOTHESIS_PROFILE := $(if $(LONG),long,default)
test-py: export OMP_NUM_THREADS := 1
test-py: build-release server ## the Python tests on the release build; ARGS= filters, LONG=1: with the slow ones
	$(call need,$(VENV),typing test)
	python -m mypy.stubtest swath._native
	python -m pytest -n 2 $(if $(LONG),,-m "not slow") $(ARGS)

.PHONY: test-ray
test-ray: build-release server ## sweeps and trainings on Ray, in .venv-rllib, where only the loopback exists if that can be made
	$(call need,$(RLLIB),rllib)
	PYTHONPATH=$(CURDIR)/env-py/python OMP_NUM_THREADS=1 \
	  scripts/on_loopback.sh $(RLLIB)/bin/python -m pytest --durations=5 tests/python/test_ray.py $(ARGS)

.PHONY: test-rerun
test-rerun: build-release ## recordings for the Rerun viewer, in .venv-rerun; its package takes 800 MB
	$(call need,$(RERUN),rerun)
	PYTHONPATH=$(CURDIR)/env-py/python $(RERUN)/bin/python -m pytest tests/python/test_film.py -k rerun $(ARGS)

# Outside the workspace, with a lock file of its own.
FUZZ = --manifest-path fuzz/Cargo.toml --target-dir target/fuzz --no-default-features

.PHONY: fuzz
fuzz: tools ## every fuzz target for a minute (SECONDS_EACH=, TARGET= one); needs a nightly toolchain and cargo-fuzz
	@cargo +nightly --version >/dev/null 2>&1 \
	  || { echo "make fuzz needs a nightly toolchain: rustup toolchain install nightly" >&2; exit 1; }
	@cargo fuzz --version >/dev/null 2>&1 || { echo "make fuzz needs cargo-fuzz: cargo install cargo-fuzz" >&2; exit 1; }
	cargo run --quiet --locked $(FUZZ) --example write_seeds
	for target in $(or $(TARGET),$$(cargo +nightly fuzz list)); do \
	  cargo +nightly fuzz run --target-dir target/fuzz $$target -- -max_total_time=$(or $(SECONDS_EACH),60) -rss_limit_mb=2048; \
	done

.PHONY: check-fuzz
check-fuzz: tools ## on the stable toolchain: the fuzz targets compile, and take their seeds
	cargo clippy --locked $(FUZZ) --all-targets -- -D warnings
	cargo test --quiet --locked $(FUZZ) --lib

.PHONY: test-slow
test-slow: ## every test, the slow ones too
	@$(MAKE) --no-print-directory test LONG=1

.PHONY: test-faults
test-faults: export LONG := 1
test-faults: export PROPTEST_CASES := 2000
test-faults: build-release server ## all that servers promise, at full size, kills and bad networks too: benchmarks/FAULTS.md; takes half an hour
	$(call need,$(VENV),test)
	@mkdir -p out/faults
	cargo test --locked -p swath-tests --test exactly_once --test wire_garbage -- --nocapture --test-threads 1 \
	  2>&1 | tee out/faults/machines.txt
	cargo test --locked -p swath-server --test over_zenoh -- --nocapture --test-threads 1 2>&1 | tee out/faults/zenoh.txt
	OMP_NUM_THREADS=1 python -m pytest $(addprefix tests/python/test_,$(addsuffix .py,remote remote_bits remote_exits remote_faults remote_low_latency remote_network remote_threads remote_unanswered two_machines worker))
	@$(MAKE) --no-print-directory test-ray
	@python -m benchmarks.faults out/faults/machines.txt out/faults/zenoh.txt

.PHONY: test-gymnasium-oldest
test-gymnasium-oldest: wheel ## the Gymnasium contract tests on the wheel, under the oldest Gymnasium and NumPy supported
	$(call need,$(OLDEST),oldest)
	$(OLDEST)/bin/python -m pip install --quiet --no-deps --force-reinstall target/wheels/*.whl
	$(OLDEST)/bin/python -m pytest $(addprefix tests/python/test_,$(addsuffix .py,gymnasium_contract choices state scenarios vector))

# Examples with other libraries, each in an environment of its own

.PHONY: examples
examples: example-zoo example-rllib ## the RL Zoo and RLlib train for some hundred steps

.PHONY: example-zoo
example-zoo: wheel ## the RL Zoo with the settings of configs/zoo, for some hundred steps, in .venv-zoo
	$(call need,$(ZOO),zoo)
	$(ZOO)/bin/python -m pip install --quiet --no-deps --force-reinstall target/wheels/*.whl
	$(ZOO_TRAIN) --algo ppo --conf-file configs/zoo/ppo.yml -n 512 -params n_steps:16 batch_size:64
	$(ZOO_TRAIN) --algo sac --conf-file configs/zoo/sac.yml -n 256 -params learning_starts:64 buffer_size:1000
ZOO_TRAIN = OMP_NUM_THREADS=1 $(ZOO)/bin/python -m rl_zoo3.train --env swath/MowerRouting-v0 --gym-packages swath \
  --eval-freq 0 --log-folder out/zoo

.PHONY: example-rllib
example-rllib: wheel ## PPO of RLlib for some hundred steps, on the native batch and on single environments, in .venv-rllib
	$(call need,$(RLLIB),rllib)
	$(RLLIB)/bin/python -m pip install --quiet --no-deps --force-reinstall target/wheels/*.whl
	for mode in vector_entry_point sync; do \
	  OMP_NUM_THREADS=1 $(RLLIB)/bin/python examples/rllib_ppo.py --vectorize-mode $$mode --iterations 2 \
	    --num-envs 4 --batch-size 512 --minibatch-size 64 --budget 0.02; \
	done

# Gates

.PHONY: lint
lint: tools ## formats, spelling, layers, paths, licences, then clippy and mypy; FAST=1 stops before anything compiles
	$(call need,$(VENV),lint)
	cargo fmt --all --check
	cargo fmt --manifest-path fuzz/Cargo.toml --check
	ruff format --check
	ruff check
	typos
	RUST_LOG=warn taplo fmt --check --diff
	python scripts/check_layers.py
	python scripts/check_paths.py
	python scripts/check_licences.py
	@$(if $(FAST),,$(MAKE) --no-print-directory lint-compiled)

.PHONY: lint-compiled
lint-compiled: tools
	$(call need,$(VENV),demo paper typing)
	cargo clippy --workspace --all-targets --locked -- -D warnings
	@$(MAKE) --no-print-directory check-fuzz
	python -m mypy

.PHONY: docs
docs: build-release docs-tools ## the site, strictly: out/site/index.html
	$(SITE) build --quiet
	@python -m scripts.site.check out/site
	@echo "the site is in out/site/index.html"

.PHONY: test-docs
test-docs: docs ## opens the site in a browser, and builds the Rust documentation, warnings denied
	$(call need,$(VENV),test)
	python -m pytest tests/python/test_site.py
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

.PHONY: docs-serve
docs-serve: build-release docs-tools ## the site on http://127.0.0.1:8000, made anew when a page changes; PORT= another one
	$(SITE) serve --dev-addr 127.0.0.1:$(or $(PORT),8000) --watch env-py/python/swath --watch scripts/site

.PHONY: docs-tools
docs-tools: tools
	@python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "the site needs Python 3.11 or newer" >&2; exit 1; }
	$(call need,$(VENV),docs)

# The same commit gives the same bytes. The theme's advertisement is no warning.
SITE = NO_MKDOCS_2_WARNING=1 SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct 2>/dev/null || echo 0) python -m mkdocs

.PHONY: ci
ci: lint browser test test-gymnasium-oldest bench-count test-docs demo ## everything that .ci/run checks, up to the first failure

# Figures

.PHONY: bench
bench: build-release counted ## steps per CPU-second beside NumPy, CartPole and EnvPool: benchmarks/RESULTS.md; QUICK=1 tries it
	$(call need,$(VENV),test)
	@$(MAKE) --no-print-directory peer-cartpole || echo "CartPole of Gymnasium will not be compared"
	@$(MAKE) --no-print-directory peer-envpool || echo "EnvPool will not be compared"
	@mkdir -p out/bench
	@if command -v valgrind >/dev/null; then python -m benchmarks.instructions $(COUNTED) --profile lap/features; \
	else echo "not measured: valgrind is not installed"; fi >out/bench/profile.txt
	python -m benchmarks.throughput --profile out/bench/profile.txt $(if $(QUICK),--quick)

.PHONY: bench-remote
bench-remote: build-release server-release ## what remote environments cost, beside dm_env_rpc and OpenEnv: benchmarks/REMOTE.md; takes five minutes, QUICK=1 tries it
	$(call need,$(VENV),test)
	@$(MAKE) --no-print-directory peer-dm_env_rpc || echo "dm_env_rpc will not be compared"
	@$(MAKE) --no-print-directory peer-openenv || echo "OpenEnv will not be compared"
	python -m benchmarks.remote $(if $(QUICK),--quick)

# Each peer in an environment of its own, so that what it needs decides nothing about swath.
PEERS := peer-cartpole peer-envpool peer-dm_env_rpc peer-openenv
.PHONY: $(PEERS)
$(PEERS): peer-%: tools
	$(call need,target/peers/$*,peer-$*)

.PHONY: bench-episodes
bench-episodes: build-release ## how long steps, episodes and the density sweep of the paper take
	$(RELEASE) cargo bench --locked -p swath-benchmarks
	rm -rf out/bench
	time python -m swath evaluate table1 --only density --agents bcp,bcp-tsp,react,jump,snake,r-snake --instances 100 --out out/bench

.PHONY: bench-pictures
bench-pictures: tools ## how long a picture of 640 x 360 pixels takes to paint, along the way of snake
	@$(RELEASE) cargo bench --quiet --locked -p swath-benchmarks --bench pictures

.PHONY: bench-planning
bench-planning: tools ## how long the plans of horizon take, and its episodes; INSTANCES= of each number of weeds
	@$(RELEASE) cargo run --quiet --release --locked -p swath-benchmarks --bin planning -- $(INSTANCES)

# The instruction set is the plain one, whatever RUSTFLAGS says: counts must be the same everywhere, and valgrind knows no AVX-512.
COUNTED := target/release/counted
.PHONY: counted
counted: export RUSTFLAGS :=
counted: tools
	$(RELEASE) cargo build --quiet --locked --profile bench -p swath-benchmarks --bin counted

.PHONY: bench-count
bench-count: ## counts the instructions of steps and episodes against benchmarks/counts.txt; RENEW=1 writes that anew
	@if [ "$$(uname -sm)" != "Linux x86_64" ]; then \
	  echo "bench-count: SKIPPED, since it needs Linux x86_64"; \
	elif ! command -v valgrind >/dev/null; then \
	  echo "bench-count: SKIPPED, since it needs valgrind (Debian: apt-get install valgrind)"; \
	  [ -z "$(CI)" ]; \
	else \
	  $(MAKE) --no-print-directory counted && python3 -m benchmarks.instructions $(COUNTED) $(if $(RENEW),--renew); \
	fi

.PHONY: profile
profile: counted ## where the instructions of one counted program go: PROGRAM=lap/features
	@python3 -m benchmarks.instructions $(COUNTED) --profile $(or $(PROGRAM),lap/features)

.PHONY: valgrind
valgrind: ## in CI: installs valgrind, which bench-count needs, from the system's packages
	@command -v valgrind >/dev/null || [ -z "$(CI)" ] || ! command -v apt-get >/dev/null \
	  || { apt-get update -qq && apt-get install -y -qq --no-install-recommends valgrind; }

.PHONY: browser
browser: ## in CI: installs Chromium, which the tests of replays and reports open, from the system's packages
	@command -v chromium >/dev/null || [ -z "$(CI)" ] || ! command -v apt-get >/dev/null \
	  || { apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium; }

.PHONY: league
league: build-release ## every agent on the same pastures: benchmarks/LEAGUE.md; goes on where it was stopped; QUICK=1 tries it, FEWER=2 halves it, ONLY= names parts
	python -m benchmarks.league $(if $(QUICK),--quick) $(if $(FEWER),--fewer $(FEWER)) $(if $(ONLY),--only $(ONLY))

.PHONY: train-learned
train-learned: build-release ## the agent learned: trains it, compiles it in, its curve and its contest; goes on where it was stopped
	$(call need,$(VENV),test)
	python -m swath train maskable-routing --out out/learned/maskable-routing
	python -m benchmarks.learned --export
	@$(MAKE) --no-print-directory build-release
	python -m benchmarks.learned

.PHONY: retrain-learned
retrain-learned: build-release ## trains the agent learned once more, SEED=1000, and says how far that policy is from the shipped one
	$(call need,$(VENV),test)
	python -m swath train maskable-routing --seed $(or $(SEED),1000) --out out/learned/again
	python -m benchmarks.learned --again out/learned/again

.PHONY: paper
paper: build-release ## the experiments of the paper: docs/reproduce, its data and figures; goes on where it was stopped
	$(call need,$(VENV),paper)
	python -m benchmarks.paper
