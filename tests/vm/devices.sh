# The buses and the lines that tests/vm/run promises; to be sourced, as root.
# shellcheck shell=bash

vm_configfs=/sys/kernel/config/gpio-sim

# vcan0 and vcan1 in this network name space; chip NAME, and the variables that tell where it is.
vm_make_devices() {
    local bus bank=$vm_configfs/$1/bank0 device chip
    for bus in vcan0 vcan1; do
        ip link add "$bus" type vcan && ip link set "$bus" up || return
    done
    mkdir "$vm_configfs/$1" "$bank" && echo 8 >"$bank/num_lines" && echo "$1" >"$bank/label" &&
        echo 1 >"$vm_configfs/$1/live" || return
    device=$(<"$vm_configfs/$1/dev_name")
    chip=$(<"$bank/chip_name")
    export GPIOSIM_CHIP=$chip GPIOSIM_LINES=/sys/devices/platform/$device/$chip
}

vm_remove_devices() {
    echo 0 >"$vm_configfs/$1/live"
    rmdir "$vm_configfs/$1/bank0" "$vm_configfs/$1"
}
