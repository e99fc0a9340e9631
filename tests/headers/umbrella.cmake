# SPDX-License-Identifier: MIT
# cmake [-DWRITE=ON] -P umbrella.cmake: compares include/patchrt/patchrt.hpp with what it should be, or writes it.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/../../cmake/sources.cmake)

set(umbrella ${patchrt_root}/include/patchrt/patchrt.hpp)
file(GLOB_RECURSE headers RELATIVE ${patchrt_root}/include ${patchrt_root}/include/patchrt/*/*.hpp)
list(SORT headers)
set(everywhere "")
set(on_host "")
foreach(header IN LISTS headers)
  patchrt_needs(needs ${patchrt_root}/include/${header})
  if(NOT needs)
    patchrt_host_only(host_only ${header})
    if(host_only)
      string(APPEND on_host "#  include <${header}>\n")
    else()
      string(APPEND everywhere "#include <${header}>\n")
    endif()
  endif()
endforeach()
set(text "// SPDX-License-Identifier: MIT
#pragma once

/// \\file
/// All of patchrt that needs no optional package.

${everywhere}")
if(on_host)
  string(APPEND text "\n#if !defined(__CUDACC__)\n${on_host}#endif\n")
endif()

set(present "")
if(EXISTS ${umbrella})
  file(READ ${umbrella} present)
endif()
if(WRITE)
  if(NOT present STREQUAL text)
    file(WRITE ${umbrella} "${text}")
  endif()
elseif(NOT present STREQUAL text)
  message(NOTICE "include/patchrt/patchrt.hpp should be\n${text}")
  message(FATAL_ERROR "patchrt.hpp does not include exactly the headers that need no optional package; "
                      "`cmake --build <build folder> --target patchrt_umbrella` writes it")
endif()
