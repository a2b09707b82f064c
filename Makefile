# A thin front to CMake and the scripts. `make demo` and `make test` do all set-up themselves.
PRESET ?= release
BUILD := build/$(PRESET)
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local

.PHONY: all deps tools build test test-exhaustive test-mutations test-sanitized test-slurm demo pipeline table2 refinement bench fuzz install docs clean
all: build

deps:
	@scripts/install-deps.sh

$(BUILD)/build.ninja: | deps
	cmake --preset $(PRESET)

tools: deps $(BUILD)/build.ninja
	cmake --build $(BUILD) -j $(JOBS) --target tools

build: deps $(BUILD)/build.ninja
	cmake --build $(BUILD) -j $(JOBS)

test: build
	cd $(BUILD) && ctest --output-on-failure -j $(JOBS)

# What docs/reliability.md promises, tried further than a test run has time for: every bit, every call, twenty kills of each training, all of the matrix; hours
test-exhaustive: build
	cd $(BUILD) && MOCAPKIT_EXHAUSTIVE=1 ctest --output-on-failure --timeout 14400 -R '^reliability|^store|^io'

# Each promise broken on purpose in a copy of the sources: its test must notice
test-mutations: deps
	/usr/bin/python3 tests/reliability/mutations.py . build/mutations

# The job scripts under a SLURM of their own, as root: needs slurm-wlm and munge (apt-get install slurm-wlm munge)
test-slurm: tools
	MOCAPKIT_BIN=$(BUILD)/bin tests/slurm/slurm.sh || [ $$? = 77 ]

# Everything under address and undefined-behaviour sanitizers, what runs on several threads under the thread sanitizer
test-sanitized: deps
	scripts/test-sanitized.sh $(JOBS)

demo: tools
	scripts/demo.sh $(BUILD)/bin

pipeline: tools
	scripts/pipeline.sh $(BUILD)/bin "$(DATA)" "$(LABELS)" "$(OUT)"

table2: tools
	@$(MAKE) --no-print-directory -f scripts/table2.mk BIN=$(BUILD)/bin

refinement: tools
	@$(MAKE) --no-print-directory -f scripts/refinement.mk BIN=$(BUILD)/bin

bench: build
	scripts/bench.sh $(BUILD)

# libFuzzer over every parser: needs clang and its runtime (apt-get install clang libclang-rt-14-dev)
fuzz: deps
	cmake --preset fuzz
	cmake --build build/fuzz -j $(JOBS) --target fuzzers
	scripts/fuzz.sh build/fuzz

docs: tools
	scripts/generate-docs.sh $(BUILD)/bin

install: build
	cmake --install $(BUILD) --prefix $(PREFIX)

clean:
	rm -rf build out
