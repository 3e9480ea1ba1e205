# A thin face over tools/setup.sh, the CMake presets and CTest.
.PHONY: run build test test-slow bench fuzz embed sanitizers unreal-plugin format clean
JOBS ?= $(shell nproc)

## Set up, build, and the main job: train over TCP on the road world, save, act with the model.
run: build
	build/release/cli/consac demo

build:
	tools/setup.sh build
	cmake --preset release -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF --log-level=WARNING
	cmake --build --preset release -j $(JOBS)

## Set up, build, all tests; those in a real engine where it can be fetched.
test:
	tools/setup.sh test
	-tools/setup.sh godot
	tools/test.sh dev

## Long learning proofs and soaks; writes the tables under bench/results.
test-slow: build
	tools/setup.sh test
	cmake --preset release --log-level=WARNING
	cmake --build --preset release -j $(JOBS) --target learning_proofs
	build/release/tests/learning_proofs bench/results/learning.md
	tools/setup.sh slow
	.venv-slow/bin/python tests/slow/ecosystem_proofs.py bench/results/ecosystem.md

## The speed tables, beside their competitors.
bench:
	tools/setup.sh bench
	bench/run.sh

## Every fuzz target for FUZZ_SECONDS each.
FUZZ_SECONDS ?= 600
fuzz:
	tools/setup.sh test
	tools/fuzz.sh $(FUZZ_SECONDS)

## core and learn as an engine compiles them, with both compilers.
embed:
	tools/setup.sh test
	tools/embed.sh

## AddressSanitizer with UndefinedBehaviorSanitizer, then ThreadSanitizer.
sanitizers:
	tools/setup.sh test
	tools/test.sh asan
	tools/test.sh tsan

## The Unreal plugin with the program for Linux and Windows, one zip for each engine version, in build/unreal.
unreal-plugin: build
	tools/windows.sh program
	tools/setup.sh unreal
	tools/package_unreal.py

format:
	git ls-files '*.h' '*.cpp' | xargs clang-format -i

clean:
	rm -rf build
