# Cross build for a Cortex-M: PM_CPU names it as gcc does; Cortex-M4 unless a preset says otherwise.
# Soft float on purpose: the control path must not use floating point, and with this ABI any use shows as a call
# to a helper, which tests/target refuses.
if(NOT PM_CPU)
    set(PM_CPU cortex-m4)
endif()
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES PM_CPU)
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR ${PM_CPU})

set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)

# There is no startup code to link a test program with.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

set(pm_cpu_flags "-mcpu=${PM_CPU} -mthumb -mfloat-abi=soft")
set(CMAKE_C_FLAGS_INIT "${pm_cpu_flags} -ffunction-sections -fdata-sections -fstack-usage -fno-common")
# Objects serve both ways of linking: across modules, as the image is, and function by function, for measurements.
string(APPEND CMAKE_C_FLAGS_INIT " -flto -ffat-lto-objects")
# Ordering for a pipeline that Cortex-M4 does not have costs registers: 8 instructions per control period.
string(APPEND CMAKE_C_FLAGS_INIT " -fno-schedule-insns")
# Enumerations are ints, as on the host: so drive_t has the same layout in both places (tests/target/drive).
string(APPEND CMAKE_C_FLAGS_INIT " -fno-short-enums")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -fno-exceptions -fno-rtti")
# The C library is built with short enumerations; none crosses its interface.
set(CMAKE_EXE_LINKER_FLAGS_INIT "${pm_cpu_flags} -fno-short-enums -Wl,--no-enum-size-warning")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
