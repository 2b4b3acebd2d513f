# linkwise in a CMake build: find_package(linkwise CONFIG), with linkwise_DIR set to what `linkwise --cmake-dir` prints.
#
#   linkwise_add_robot(TARGET ROBOT FILE [NAME name] [STATIC | SHARED] [FLOAT] [OPTIONS option...])
#
# makes the library TARGET of a robot's dynamics, with its folder of headers: whoever links it includes "name.h".
#
#   ROBOT    the robot's file, or the name of a built-in robot
#   NAME     how its header and its functions begin; TARGET if not given
#   FLOAT    compile the functions in float, whose names end in f, in place of those in double
#   OPTIONS  more of `linkwise generate`: --base floating, --lock JOINT=VALUE, --kernel loops
#
# Without STATIC or SHARED, BUILD_SHARED_LIBS says which. The C is compiled as C++ where the project has no C. Nothing is
# asked of the building machine but to run `linkwise`, so a toolchain for another machine needs no more.

cmake_minimum_required(VERSION 3.20)
cmake_policy(PUSH)
cmake_policy(VERSION 3.20...3.31)

# The program of the same installation: a module and a program of two versions may not fit.
find_program(
    LINKWISE_EXECUTABLE
    NAMES linkwise
    HINTS "${CMAKE_CURRENT_LIST_DIR}/../../../../../bin" "${CMAKE_CURRENT_LIST_DIR}/../../../../Scripts"
    NO_CMAKE_FIND_ROOT_PATH
    DOC "linkwise, which generates packages of robots"
)
if(NOT LINKWISE_EXECUTABLE)
    set(linkwise_FOUND FALSE)
    set(linkwise_NOT_FOUND_MESSAGE "the program linkwise is not in PATH; set LINKWISE_EXECUTABLE to it")
    cmake_policy(POP)
    return()
endif()
if(NOT "${_LINKWISE_ASKED}" STREQUAL "${LINKWISE_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}")
    execute_process(
        COMMAND "${LINKWISE_EXECUTABLE}" --cmake-dir
        OUTPUT_VARIABLE _linkwise_dir
        ERROR_VARIABLE _linkwise_said
        OUTPUT_STRIP_TRAILING_WHITESPACE
        RESULT_VARIABLE _linkwise_status
    )
    file(REAL_PATH "${CMAKE_CURRENT_LIST_DIR}" _linkwise_here)
    if(_linkwise_status EQUAL 0)
        file(REAL_PATH "${_linkwise_dir}" _linkwise_dir)
    endif()
    if(NOT "${_linkwise_dir}" STREQUAL "${_linkwise_here}")
        set(linkwise_FOUND FALSE)
        set(linkwise_NOT_FOUND_MESSAGE
            "${LINKWISE_EXECUTABLE} is not of the installation in ${_linkwise_here}; set LINKWISE_EXECUTABLE to the program of that one, or linkwise_DIR to what this one prints for --cmake-dir ${_linkwise_said}"
        )
        cmake_policy(POP)
        return()
    endif()
    set(_LINKWISE_ASKED "${LINKWISE_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}" CACHE INTERNAL "what was found to fit")
endif()

# In `variable`, the path of a file that a build may make itself, or FILE as it is where it names a built-in robot.
# CMake knows of no file that a command of another folder makes: a path in a folder of builds is taken at its word.
function(_linkwise_robot_path variable file)
    cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE OUTPUT_VARIABLE source)
    cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}" NORMALIZE OUTPUT_VARIABLE built)
    get_property(source_is_made SOURCE "${source}" PROPERTY GENERATED)
    get_property(built_is_made SOURCE "${built}" PROPERTY GENERATED)
    cmake_path(IS_PREFIX CMAKE_BINARY_DIR "${source}" NORMALIZE in_build)
    cmake_path(IS_PREFIX PROJECT_BINARY_DIR "${source}" NORMALIZE in_projects_build)
    if(IS_ABSOLUTE "${file}" AND (in_build OR in_projects_build))
        set(source_is_made TRUE)
    endif()
    if((EXISTS "${source}" OR source_is_made) AND NOT IS_DIRECTORY "${source}")
        set(found "${source}")
    elseif(built_is_made)
        set(found "${built}")
    elseif(file MATCHES "[./\\]")
        message(FATAL_ERROR
            "linkwise_add_robot: ROBOT ${file}: no such file, nor one that a command before makes; give one that a command of another folder makes by its whole path in the build's folder"
        )
    else()
        set(found "${file}")
    endif()
    set(${variable} "${found}" PARENT_SCOPE)
endfunction()

# Flags under which gcc and clang make the most of the emitted C; what the header prints, less what is of one machine.
function(_linkwise_compile_options target language)
    if(CMAKE_${language}_COMPILER_ID MATCHES "^(GNU|Clang|AppleClang)$" AND NOT MSVC)
        # A project's own level, such as a firmware's -Os, stays: the last one holds, and those of add_compile_options
        # come behind this. SHELL: keeps it apart from a -O2 there, of which CMake would take the first alone.
        set(types "${CMAKE_BUILD_TYPE}")
        if(CMAKE_CONFIGURATION_TYPES)
            set(types ${CMAKE_CONFIGURATION_TYPES})
        endif()
        foreach(type IN ITEMS "" ${types})
            string(TOUPPER "${type}" upper)
            if(
                NOT upper STREQUAL "DEBUG"
                AND NOT "${CMAKE_${language}_FLAGS} ${CMAKE_${language}_FLAGS_${upper}}" MATCHES "(^|[ \t])-O"
            )
                target_compile_options(${target} BEFORE PRIVATE "$<$<CONFIG:${type}>:SHELL:-O2>")
            endif()
        endforeach()
        target_compile_options(
            ${target} PRIVATE -ftree-vectorize -fno-tree-slp-vectorize -ffp-contract=fast
        )
    endif()
endfunction()

function(linkwise_add_robot target)
    cmake_parse_arguments(PARSE_ARGV 1 arg "STATIC;SHARED;FLOAT" "ROBOT;NAME" "OPTIONS")
    if(arg_UNPARSED_ARGUMENTS)
        message(FATAL_ERROR "linkwise_add_robot: ${arg_UNPARSED_ARGUMENTS} is not an argument; give those of linkwise behind OPTIONS")
    endif()
    if(NOT arg_ROBOT)
        message(FATAL_ERROR "linkwise_add_robot: ${target} has no robot; give ROBOT and its file")
    endif()
    if(arg_STATIC AND arg_SHARED)
        message(FATAL_ERROR "linkwise_add_robot: ${target} cannot be both STATIC and SHARED; make a target of each")
    endif()
    if(NOT arg_NAME)
        set(arg_NAME "${target}")
    endif()
    if(NOT arg_NAME MATCHES "^[A-Za-z]([A-Za-z0-9_]*[A-Za-z0-9])?$")
        message(FATAL_ERROR "linkwise_add_robot: ${arg_NAME} is not a name of letters, digits and _; give another with NAME")
    endif()
    get_property(languages GLOBAL PROPERTY ENABLED_LANGUAGES)
    if("C" IN_LIST languages)
        set(language C)
    elseif("CXX" IN_LIST languages)
        set(language CXX)
    else()
        message(FATAL_ERROR "linkwise_add_robot: the project has neither C nor C++; enable one with project(... LANGUAGES C)")
    endif()

    _linkwise_robot_path(robot "${arg_ROBOT}")
    set(robot_file)
    if(IS_ABSOLUTE "${robot}")
        set(robot_file "${robot}")
    endif()
    set(options)
    set(before)
    string(REGEX REPLACE "(^|;)--constraints=" "\\1--constraints;" asked "${arg_OPTIONS}")
    foreach(option IN LISTS asked)
        # The depfile has paths as they were given, and CMake takes them from the folder of the build.
        if(before STREQUAL "--constraints")
            cmake_path(ABSOLUTE_PATH option BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
        endif()
        list(APPEND options "${option}")
        set(before "${option}")
    endforeach()

    set(out "${CMAKE_CURRENT_BINARY_DIR}/linkwise/${target}")
    set(package "${out}/${arg_NAME}")
    set(unit "${arg_NAME}.c")
    if(arg_FLOAT)
        set(unit "${arg_NAME}f.c")
    endif()
    # What is compiled is a file that includes the package's: CMake knows of no file in it. So the rule that linkwise
    # writes can have them all as inputs of the stamp, and one that is removed or changed by hand is made again.
    set(source "${out}/${unit}")
    file(CONFIGURE OUTPUT "${source}" CONTENT "#include \"${arg_NAME}/c/${unit}\"\n")
    # Two files stand for the package. The stamp is as new as the last run: make compares times, and what is generated
    # keeps its own where nothing differs. The copy of the manifest, which has the hash of every file, is as new as the last
    # difference: by it the library is compiled again. It is a copy because an interrupted ninja removes what a command
    # was making.
    set(stamp "${out}/${arg_NAME}.stamp")
    set(manifest "${out}/${arg_NAME}.manifest.json")
    add_custom_command(
        OUTPUT "${stamp}"
        BYPRODUCTS "${manifest}"
        COMMAND
            "${LINKWISE_EXECUTABLE}" generate "${robot}" --out "${out}" --name "${arg_NAME}" --backend c --replace
            --depfile "${stamp}.d" --stamp "${stamp}" ${options}
        COMMAND "${CMAKE_COMMAND}" -E copy_if_different "${package}/manifest.json" "${manifest}"
        DEPENDS ${robot_file}
        DEPFILE "${stamp}.d"
        WORKING_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}"
        COMMENT "Generating the dynamics of ${arg_NAME}"
        VERBATIM
    )

    set(kind)
    if(arg_STATIC)
        set(kind STATIC)
    elseif(arg_SHARED)
        set(kind SHARED)
    endif()
    add_library(${target} ${kind} "${source}" "${stamp}")
    set_source_files_properties("${source}" PROPERTIES LANGUAGE ${language} OBJECT_DEPENDS "${manifest}")
    set_target_properties(
        ${target}
        PROPERTIES
            WINDOWS_EXPORT_ALL_SYMBOLS ON
            C_VISIBILITY_PRESET default
            CXX_VISIBILITY_PRESET default
            LINKER_LANGUAGE ${language}
            PUBLIC_HEADER "${package}/c/${arg_NAME}.h"
    )
    if(NOT CMAKE_SYSTEM_NAME MATCHES "^Generic") # bare metal: no library is loaded, and such code is slower
        set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    endif()
    foreach(tool CLANG_TIDY CPPCHECK CPPLINT INCLUDE_WHAT_YOU_USE)
        set_property(TARGET ${target} PROPERTY ${language}_${tool}) # for the project's own files
    endforeach()
    if(language STREQUAL "C")
        target_compile_features(${target} PRIVATE c_std_99)
    else()
        target_compile_features(${target} PRIVATE cxx_std_17)
    endif()
    _linkwise_compile_options(${target} ${language})
    target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${package}/c>" "$<INSTALL_INTERFACE:include>")
    if(NOT WIN32 AND NOT APPLE)
        target_link_libraries(${target} PUBLIC -lm) # a bare m may be a target of the project
    endif()
endfunction()

cmake_policy(POP)
