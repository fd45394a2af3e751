# retrace_verilate(<target> TOP_MODULE <module> PREFIX <class> SOURCES <files...> [TRACE_FST] [OPT_FAST <flag>] [OPT_SLOW <flag>] [OPT_GLOBAL <flag>]
#                  [VERILATOR_ARGS <arguments...>])
# Adds a Verilated model to a library, as Verilator's own verilate() does, but Verilator runs once, in the build and not at configuration, and each
# model is two translation units, what runs at every clock (OPT_FAST) and what runs once (OPT_SLOW), instead of about 20 that read the same headers.
find_package(verilator REQUIRED)

function(retrace_verilate target)
  cmake_parse_arguments(arg "TRACE_FST" "TOP_MODULE;PREFIX;OPT_FAST;OPT_SLOW;OPT_GLOBAL" "SOURCES;VERILATOR_ARGS" ${ARGN})
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/${arg_PREFIX}.dir)
  file(MAKE_DIRECTORY ${folder})
  set(arguments ${arg_VERILATOR_ARGS})
  set(runtime verilated verilated_dpi verilated_threads)
  set(coverage 0)
  if(arguments MATCHES "--coverage")
    set(coverage 1)
    list(APPEND runtime verilated_cov)
  endif()
  set(trace 0)
  if(arg_TRACE_FST)
    set(trace 1)
    list(APPEND arguments --trace-fst)
    list(APPEND runtime verilated_fst_c)
  endif()
  set(fast ${folder}/${arg_PREFIX}_fast.cpp)
  set(slow ${folder}/${arg_PREFIX}_slow.cpp)
  add_custom_command(
    OUTPUT ${fast} ${slow}
    BYPRODUCTS ${folder}/${arg_PREFIX}.h ${folder}/${arg_PREFIX}___024root.h
    COMMAND ${VERILATOR_BIN} --cc --compiler gcc --make cmake --Mdir ${folder} --prefix ${arg_PREFIX} --top ${arg_TOP_MODULE} ${arguments} ${arg_SOURCES}
    COMMAND ${CMAKE_COMMAND} -D prefix=${arg_PREFIX} -D folder=${folder} -P ${CMAKE_SOURCE_DIR}/scripts/cmake/MergeVerilated.cmake
    DEPENDS ${arg_SOURCES} ${CMAKE_SOURCE_DIR}/scripts/cmake/MergeVerilated.cmake
    DEPFILE ${folder}/merged.d
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} COMMENT "Verilating ${arg_PREFIX}" VERBATIM)
  set_source_files_properties(${fast} PROPERTIES COMPILE_OPTIONS "${arg_OPT_FAST}")
  set_source_files_properties(${slow} PROPERTIES COMPILE_OPTIONS "${arg_OPT_SLOW}")
  list(TRANSFORM runtime REPLACE "(.+)" "${VERILATOR_ROOT}/include/\\1.cpp")
  set_source_files_properties(${runtime} PROPERTIES COMPILE_OPTIONS "${arg_OPT_GLOBAL}")
  target_sources(${target} PRIVATE ${fast} ${slow} ${runtime})
  target_include_directories(${target} PUBLIC ${folder} ${VERILATOR_ROOT}/include ${VERILATOR_ROOT}/include/vltstd)
  target_compile_definitions(${target} PRIVATE VM_COVERAGE=${coverage} VM_SC=0 VM_TRACE=${trace} VM_TRACE_VCD=0 VM_TRACE_FST=${trace})
  target_link_libraries(${target} PUBLIC ${VERILATOR_MT_CFLAGS})
endfunction()
