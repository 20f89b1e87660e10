#!/usr/bin/env python3
"""Write firmware/math/trig_table.c: 128 directions in Q31. Usage: gen_trig_table.py > firmware/math/trig_table.c"""
from math import cos, pi, sin

COUNT = 128
LARGEST = 2**31 - 1


def q31(value):
    return max(-LARGEST, min(LARGEST, round(value * 2**31)))


print("/* Made by tools/gen_trig_table.py; checked by tests/unit/math/trig_test.cpp. */")
print('#include "firmware/math/trig.h"\n')
print("/* clang-format off */")
print(f"const pm_pair_t pm_dir_table[{COUNT}] = {{")
for k in range(COUNT):
    angle = 2 * pi * k / COUNT
    print(f"    {{{q31(cos(angle))}, {q31(sin(angle))}}},")
print("};")
