# Run by retrace_verilate() after Verilator: cmake -D prefix=<class> -D folder=<folder> -P MergeVerilated.cmake
# Writes <class>_fast.cpp and <class>_slow.cpp, which include what Verilator's list names, and the dependencies of both.
include(${folder}/${prefix}.cmake)
function(merge name)
  set(text "// Written by scripts/cmake/MergeVerilated.cmake.\n")
  foreach(source ${ARGN})
    string(APPEND text "#include \"${source}\"\n")
  endforeach()
  file(WRITE ${folder}/${prefix}_${name}.cpp "${text}")
endfunction()
merge(fast ${${prefix}_CLASSES_FAST} ${${prefix}_SUPPORT_FAST})
merge(slow ${${prefix}_CLASSES_SLOW} ${${prefix}_SUPPORT_SLOW})
list(JOIN ${prefix}_DEPS " " dependencies)
file(WRITE ${folder}/merged.d "${folder}/${prefix}_fast.cpp ${folder}/${prefix}_slow.cpp: ${dependencies}\n")
