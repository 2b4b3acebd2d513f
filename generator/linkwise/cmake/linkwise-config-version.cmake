# The version of this installation, from where linkwise itself has it; any that is asked for must be this one or older,
# of the same first number.
file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/../../linkwise_runtime/version.py" _linkwise_version REGEX "^VERSION = ")
string(REGEX REPLACE ".*\"(.*)\".*" "\\1" PACKAGE_VERSION "${_linkwise_version}")
string(REGEX MATCH "^[0-9]+" _linkwise_major "${PACKAGE_VERSION}")
if("${PACKAGE_FIND_VERSION}" STREQUAL "" OR
   ("${PACKAGE_FIND_VERSION_MAJOR}" STREQUAL "${_linkwise_major}" AND NOT PACKAGE_VERSION VERSION_LESS PACKAGE_FIND_VERSION))
    set(PACKAGE_VERSION_COMPATIBLE TRUE)
    if("${PACKAGE_FIND_VERSION}" STREQUAL "${PACKAGE_VERSION}")
        set(PACKAGE_VERSION_EXACT TRUE)
    endif()
else()
    set(PACKAGE_VERSION_COMPATIBLE FALSE)
endif()
