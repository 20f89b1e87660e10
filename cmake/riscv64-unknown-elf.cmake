# Cross build for a 32-bit RISC-V with picolibc: PM_CPU names its instruction set. No floating point, as on Cortex-M.
if(NOT PM_CPU)
    set(PM_CPU rv32imac)
endif()
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES PM_CPU)
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR ${PM_CPU})

set(CMAKE_C_COMPILER riscv64-unknown-elf-gcc)
set(CMAKE_CXX_COMPILER riscv64-unknown-elf-g++)

# There is no startup code to link a test program with.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

set(pm_cpu_flags "-march=${PM_CPU} -mabi=ilp32")
# The compiler's flags are the linker's too, and specs may be given only once.
set(CMAKE_C_FLAGS_INIT "${pm_cpu_flags} --specs=picolibc.specs -ffunction-sections -fdata-sections -fstack-usage -fno-common")
# As on Cortex-M: objects for linking across modules and function by function.
string(APPEND CMAKE_C_FLAGS_INIT " -flto -ffat-lto-objects")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -fno-exceptions -fno-rtti")
set(CMAKE_EXE_LINKER_FLAGS_INIT "${pm_cpu_flags}")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
