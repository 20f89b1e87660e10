# pm_target_program(NAME n SOURCES file... [LIBS lib...] [LTO])
# A program for a QEMU board with the processor PM_CPU, to be run by tests/target/count.py. main() may print and
# read files. LTO: link as the flashed image is linked; without it every function keeps its name and can be counted.
set(pm_target_support ${PROJECT_SOURCE_DIR}/tests/target/support)

# tests/target/machine.py knows the same boards.
if(PM_CPU MATCHES "^rv32")
    set(pm_target_startup startup_riscv.c)
    # QEMU's virt has one RAM at 0x80000000; picolibc's linker script wants it in two parts.
    set(pm_target_link --oslib=semihost
        -Wl,--defsym=__flash=0x80000000,--defsym=__flash_size=4M,--defsym=__ram=0x80400000,--defsym=__ram_size=4M)
    set(pm_target_script)
else()
    set(pm_target_startup startup_arm.c)
    set(pm_target_board_cortex-m0plus microbit)
    set(pm_target_board_cortex-m33 mps2-an505)
    set(pm_target_board_cortex-m4 mps2-an386)
    set(pm_target_script ${pm_target_support}/${pm_target_board_${PM_CPU}}.ld)
    set(pm_target_link --specs=nano.specs -L ${pm_target_support} -T ${pm_target_script})
    list(APPEND pm_target_script ${pm_target_support}/cortex_m.ld)
endif()

function(pm_target_program)
    cmake_parse_arguments(ARG "LTO" "NAME" "SOURCES;LIBS" ${ARGN})
    if(ARG_UNPARSED_ARGUMENTS)
        message(FATAL_ERROR "pm_target_program: do not know what to do with ${ARG_UNPARSED_ARGUMENTS}")
    endif()
    if(NOT TARGET pm_target_startup)
        add_library(pm_target_startup OBJECT
            ${pm_target_support}/${pm_target_startup} ${pm_target_support}/semihost.c)
        # Its symbols are wanted by assembler and linker script, which the optimiser across modules does not see.
        target_compile_options(pm_target_startup PRIVATE -fno-lto)
    endif()
    add_executable(${ARG_NAME} ${ARG_SOURCES} $<TARGET_OBJECTS:pm_target_startup>)
    set_target_properties(${ARG_NAME} PROPERTIES
        SUFFIX .elf
        LINK_DEPENDS "${pm_target_script}")
    target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LIBS})
    target_link_options(${ARG_NAME} PRIVATE
        $<IF:$<BOOL:${ARG_LTO}>,-flto,-fno-lto> -nostartfiles -Wl,--gc-sections ${pm_target_link})
endfunction()

# pm_add_count_test(NAME n PROGRAM target FUNCTIONS f... [LIMITS f=N...] [MEANS f=N...] [ARGUMENTS word...])
# A test that counts instructions per call and fails when a call exceeds its limit, or the mean of all calls theirs.
function(pm_add_count_test)
    cmake_parse_arguments(ARG "" "NAME;PROGRAM" "FUNCTIONS;LIMITS;MEANS;ARGUMENTS" ${ARGN})
    set(options)
    foreach(item IN LISTS ARG_FUNCTIONS)
        list(APPEND options --function ${item})
    endforeach()
    foreach(item IN LISTS ARG_LIMITS)
        list(APPEND options --limit ${item})
    endforeach()
    foreach(item IN LISTS ARG_MEANS)
        list(APPEND options --mean ${item})
    endforeach()
    add_test(NAME target.${ARG_NAME}
        COMMAND ${PM_PYTHON} ${PROJECT_SOURCE_DIR}/tests/target/count.py $<TARGET_FILE:${ARG_PROGRAM}>
            ${options} -- ${ARG_ARGUMENTS}
        WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(target.${ARG_NAME} PROPERTIES LABELS target TIMEOUT 300)
endfunction()
