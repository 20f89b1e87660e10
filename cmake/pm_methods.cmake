# pm_methods(list out): names of the methods of a list, PM_METHOD(name, ...), in their order.
function(pm_methods list out)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${list})
    file(STRINGS ${PROJECT_SOURCE_DIR}/${list} rows REGEX "^PM_METHOD\\(")
    list(TRANSFORM rows REPLACE "^PM_METHOD\\(([a-z0-9_]+),.*" "\\1")
    set(${out} ${rows} PARENT_SCOPE)
endfunction()

# pm_method_fact(file key out): the value of `key: value` in the file of a method, "" when it has none.
function(pm_method_fact file key out)
    set(value "")
    if(EXISTS ${PROJECT_SOURCE_DIR}/${file})
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${file})
        file(STRINGS ${PROJECT_SOURCE_DIR}/${file} value REGEX "^${key}: ")
        string(REGEX REPLACE "^${key}: *([^#]*[^# ]).*" "\\1" value "${value}")
    endif()
    set(${out} "${value}" PARENT_SCOPE)
endfunction()
