#!/bin/sh
# Runs the built C and C++ tests in the folder $1 under valgrind: any invalid access, use of undefined values, leaked block or,
# where there are threads, data race fails. valgrind knows no AVX-512 and hides it, so that the library takes its other paths.
set -eu
command -v valgrind >/dev/null || { echo "check-memory: valgrind is not installed"; exit 1; }
cd "$1"
for program in misuse_load_test saved_model_test leave_out_test material_test misuse_test abi_test states_test hpp_test; do
    echo "== memcheck $program"
    # A pool's threads live on to the end of the process, and so what they hold is "possibly" lost.
    # states_test forks: its child has not the threads of its parent, and so has lost what they held.
    leaks=full
    [ "$program" = states_test ] && leaks=no
    valgrind -q --error-exitcode=9 --leak-check=$leaks --show-leak-kinds=definite,indirect \
        --errors-for-leak-kinds=definite,indirect "./$program" |
        grep -v '^ok' || true
done > check_memory.log 2>&1
for tool in helgrind drd; do
    echo "== $tool hpp_test"
    valgrind -q --tool=$tool --error-exitcode=9 ./hpp_test | grep -v '^ok' || true
done >> check_memory.log 2>&1
cat check_memory.log
if grep -q '^==.*== ' check_memory.log || grep -q '^FAIL' check_memory.log; then
    echo "check-memory: FAILED"
    exit 1
fi
echo "check-memory: OK"
