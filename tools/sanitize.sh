#!/bin/sh
# The laws on an extension built with the address and undefined-behaviour sanitizers.
# Usage: tools/sanitize.sh [pytest arguments]; PYTHON names an interpreter with the test extra and nanobind.
set -eu
cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
build=build/sanitize
flags="-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -g1"
cmake -S . -B $build -DSKBUILD=ON -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS="$flags" \
    -DPython_EXECUTABLE="$(command -v "$python")" -DARMANGLE_LEVELS="${ARMANGLE_LEVELS:-avx2}" -DARMANGLE_STUB=OFF > $build.log 2>&1 ||
    { tail -n 20 $build.log; exit 1; }
cmake --build $build -j "$(nproc)"
rm -rf $build/site
cp -r src $build/site
rm -f $build/site/armangle/*.so
cp $build/bindings/*.so $build/site/armangle/
# Python itself is not instrumented: the sanitizer comes first, and its leaks are Python's own.
export LD_PRELOAD="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libubsan.so)"
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 PYTHONMALLOC=malloc
export PYTHONPATH=$build/site
if [ $# -eq 0 ]; then
    set -- tests/refusals/test_bad_input.py tests/laws/test_threads.py tests/laws/test_kinematics.py tests/laws/test_feasible.py \
        tests/laws/test_near_shoulder.py
fi
exec "$python" -m pytest -q -p no:cacheprovider "$@"
