# pm_target_program(NAME n SOURCES file... [LIBS lib...] [LTO])
# A program for QEMU's Cortex-M4 board, to be run by tests/target/count.py. main() may print and read files.
# LTO: link as the flashed image is linked; without it every function keeps its name and can be counted.
set(pm_target_support ${PROJECT_SOURCE_DIR}/tests/target/support)

function(pm_target_program)
    cmake_parse_arguments(ARG "LTO" "NAME" "SOURCES;LIBS" ${ARGN})
    if(ARG_UNPARSED_ARGUMENTS)
        message(FATAL_ERROR "pm_target_program: do not know what to do with ${ARG_UNPARSED_ARGUMENTS}")
    endif()
    if(NOT TARGET pm_target_startup)
        add_library(pm_target_startup OBJECT ${pm_target_support}/startup.c)
    endif()
    add_executable(${ARG_NAME} ${ARG_SOURCES} $<TARGET_OBJECTS:pm_target_startup>)
    set_target_properties(${ARG_NAME} PROPERTIES
        SUFFIX .elf
        LINK_DEPENDS ${pm_target_support}/mps2.ld)
    target_link_libraries(${ARG_NAME} PRIVATE ${ARG_LIBS})
    target_link_options(${ARG_NAME} PRIVATE
        $<IF:$<BOOL:${ARG_LTO}>,-flto,-fno-lto> -nostartfiles --specs=nano.specs -Wl,--gc-sections -T ${pm_target_support}/mps2.ld)
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
