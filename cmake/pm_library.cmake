# pm_library(name [LIBS lib...]): the static library of all *.c in this folder.
# A folder with headers only becomes an interface library, so that it can be linked all the same.
# *_config.c, the makers of configurations, run once and are never in a hurry: small on the target, with one stack
# frame per step instead of the sum of all in one function.
function(pm_library name)
    cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
    file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.c)
    if(CMAKE_CROSSCOMPILING)
        set(makers ${sources})
        list(FILTER makers INCLUDE REGEX "_config\\.c$")
        set_source_files_properties(${makers} PROPERTIES COMPILE_OPTIONS "-Os;-fno-inline")
    endif()
    if(sources)
        add_library(${name} STATIC ${sources})
        target_link_libraries(${name} PUBLIC ${ARG_LIBS})
        if(PM_COVERAGE AND name MATCHES "^pm_") # not the plant, whose large functions take minutes
            target_compile_options(${name} PRIVATE -O0 --coverage) # inlined saturations would count in each place
            target_link_options(${name} PUBLIC --coverage)
        endif()
    else()
        add_library(${name} INTERFACE)
        target_link_libraries(${name} INTERFACE ${ARG_LIBS})
    endif()
endfunction()
