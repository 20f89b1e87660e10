# Shared by the scripts in tools/ and by cmake/pm_python.cmake; to be sourced.
# shellcheck shell=bash

# The interpreter that sees the distribution's packages (matplotlib, yaml). A python3 found first on
# PATH may be a private one without them. PM_PYTHON overrides.
pm_python() {
    if [[ -n ${PM_PYTHON:-} ]]; then
        echo "$PM_PYTHON"
    elif [[ -x /usr/bin/python3 ]]; then
        echo /usr/bin/python3
    else
        command -v python3
    fi
}

# Prints the last lines of a log, for the reader of a failure.
pm_show_log() {
    echo "--- last lines of $1"
    tail -n "${2:-60}" "$1"
    echo "---"
}

# pm_quietly LOG COMMAND...: output goes to the log and is shown only on failure.
pm_quietly() {
    local log=$1
    shift
    mkdir -p "$(dirname "$log")"
    if ! "$@" >"$log" 2>&1; then
        pm_show_log "$log"
        return 1
    fi
}

# Configures and builds a preset. Always configures: it takes a second, and Ninja does not see a changed preset.
pm_build() {
    local preset=$1
    shift
    pm_quietly "out/logs/configure-$preset.log" cmake --preset "$preset"
    pm_quietly "out/logs/build-$preset.log" cmake --build --preset "$preset" "$@"
}

# The processors beside that of the board for which the core is built and shown right.
# shellcheck disable=SC2034
pm_portable_presets=(cortex-m0plus cortex-m33 rv32imac)
