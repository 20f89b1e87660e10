# pm_warnings: the warnings of every target of ours. Third-party headers are system headers, which do not warn.
add_library(pm_warnings INTERFACE)

set(pm_warnings_both
    -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wundef -Wdouble-promotion -Wcast-align -Wcast-qual
    -Wvla -Wformat=2 -Wpointer-arith -Wwrite-strings -Wredundant-decls -Wimplicit-fallthrough)
set(pm_warnings_c -Wstrict-prototypes -Wmissing-prototypes -Wold-style-definition)
set(pm_warnings_cxx -Wnon-virtual-dtor -Woverloaded-virtual)

target_compile_options(pm_warnings INTERFACE
    ${pm_warnings_both}
    "$<$<COMPILE_LANGUAGE:C>:${pm_warnings_c}>"
    "$<$<COMPILE_LANGUAGE:CXX>:${pm_warnings_cxx}>"
    $<$<BOOL:${PM_WERROR}>:-Werror>)
