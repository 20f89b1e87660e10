#!/usr/bin/env bash
# What tests/vm/run promises, seen from inside.
set -euo pipefail

check() {
    local what=$1
    shift
    if ! "$@"; then
        echo "FAIL  $what" >&2
        exit 1
    fi
    echo "PASS  $what"
}

for bus in vcan0 vcan1; do
    check "$bus is up" ip -br link show up "$bus"
done
check "the chip is there" test -c "/dev/$GPIOSIM_CHIP"
check "it has eight lines" test -d "$GPIOSIM_LINES/sim_gpio7"
check "and no more" test ! -d "$GPIOSIM_LINES/sim_gpio8"
check "the caller's folder" test -f tests/vm/run_test.sh
check "stdin is empty" test -z "$(cat)"
check "we are root" test "$(id -u)" = 0
