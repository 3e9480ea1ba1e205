# A thin face over tools/setup.sh, the CMake presets and CTest.
.PHONY: run help build test test-slow twin-judges robots bench fuzz embed sanitizers unreal-plugin release release-check format site clean
JOBS ?= $(shell nproc)

## Set up, build, and the main job: train over TCP on the road world, save, act with the model.
run: build
	@build/release/cli/consac demo

## What there is to make.
help:
	@awk '/^## /{words = words " " substr($$0, 4)} /^[a-z-]+:/{if (words) printf "make %-14s%s\n", substr($$1, 1, index($$1, ":") - 1), words; words = ""}' Makefile

## Set up, and the program alone: build/release/cli/consac.
build:
	@tools/setup.sh build
	@echo "build: compiling the program, a minute or two on two cores, seconds when it is up to date"
	@cmake --preset release -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF --log-level=WARNING >/dev/null
	@start=$$(date +%s); cmake --build --preset release -j $(JOBS) --target programs && \
	  echo "build: build/release/cli/consac is ready after $$(($$(date +%s) - start)) s"

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
	.venv/bin/python tests/hostile/hostile.py --seconds 600 --seed $$(date +%j)
	build/release/tests/learning_proofs bench/results/learning.md bench/results/sb3_curves.json
	python3 tests/slow/viewer_page.py build/viewer
	python3 tests/slow/twin_story.py build/viewer
	$(MAKE) twin-judges robots
	tools/setup.sh slow
	.venv-slow/bin/python tests/slow/ecosystem_proofs.py bench/results/ecosystem.md

## What other people's programs say of the files of a twin: glTF, USD, MJCF, URDF; a part of test-slow.
twin-judges:
	tools/setup.sh judges
	$(MAKE) build
	.venv-judges/bin/python tests/slow/twin_judges.py bench/results/twin_judges.md --node build/judges --converter .venv-converter

## Other people's robots, judged by other people's programs; a part of test-slow.
robots:
	tools/setup.sh robots
	$(MAKE) build
	.venv-judges/bin/python tests/slow/robots.py build/robots bench/results/robots.md --validator build/judges

## The speed tables, beside their competitors.
bench:
	tools/setup.sh bench
	bench/run.sh

## All fuzz targets, FUZZ_SECONDS of a core in all.
FUZZ_SECONDS ?= 3600
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
unreal-plugin:
	tools/cross.sh linux-x86_64-musl
	tools/cross.sh windows-x86_64
	tools/package_unreal.py

## The documentation as a site, in build/site; every link of it is checked.
site:
	tools/setup.sh site
	.venv-site/bin/python tools/build_site.py

## What a release page offers, in dist: programs for five systems, add-ons, packages, checksums, licences.
release:
	tools/release.sh

## Tries what is in dist in other systems' roots, emulated ARM64 and Wine; writes bench/results/release.md.
release-check:
	tools/release_check.sh

## The C++ sources as .clang-format wants them.
format:
	git ls-files '*.h' '*.cpp' | xargs clang-format -i

## Removes what was built.
clean:
	rm -rf build
