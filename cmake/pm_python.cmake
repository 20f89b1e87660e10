# PM_PYTHON: the interpreter that sees the distribution's Python packages. tools/common.sh decides.
if(NOT PM_PYTHON)
    execute_process(
        COMMAND bash -c ". tools/common.sh && pm_python"
        WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
        OUTPUT_VARIABLE PM_PYTHON_FOUND
        OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
    set(PM_PYTHON ${PM_PYTHON_FOUND} CACHE FILEPATH "Python interpreter for tests and generators")
endif()
