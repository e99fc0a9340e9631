# SPDX-License-Identifier: MIT
# The optional parts of patchrt and what each needs. Serves the project itself and, installed, find_package(patchrt).

set(patchrt_components pack openmp eigen thrust cuda)

# What a component links besides patchrt::patchrt.
set(patchrt_pack_links patchrt_xsimd_headers)
set(patchrt_openmp_links OpenMP::OpenMP_CXX)
set(patchrt_eigen_links Eigen3::Eigen)
set(patchrt_thrust_links patchrt_thrust_headers)
set(patchrt_cuda_links "")

# A target for another project's headers that brings their include directories and nothing else.
macro(patchrt_add_headers target directories)
  if(NOT TARGET ${target})
    add_library(${target} INTERFACE IMPORTED)
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${directories}"
                                               INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${directories}")
  endif()
endmacro()

# Finds what `component` needs: sets patchrt_<component>_FOUND and, when that is false, patchrt_<component>_reason.
# A macro, so that what the find modules set stays with the caller.
macro(patchrt_find_component component)
  set(patchrt_${component}_FOUND FALSE)
  if("${component}" STREQUAL "pack")
    set(patchrt_pack_reason "xsimd 8 or later was not found (Debian: libxsimd-dev)")
    find_package(xsimd QUIET)
    if(xsimd_FOUND AND NOT xsimd_VERSION VERSION_LESS 8)
      set(patchrt_pack_FOUND TRUE)
      # Debian 12's xsimd target links xtl, which its package neither brings nor needs.
      get_target_property(patchrt_xsimd_include_dirs xsimd INTERFACE_INCLUDE_DIRECTORIES)
      patchrt_add_headers(patchrt_xsimd_headers "${patchrt_xsimd_include_dirs}")
    endif()
  elseif("${component}" STREQUAL "openmp")
    set(patchrt_openmp_reason "this C++ compiler has no OpenMP that CMake finds (Debian, with clang: libomp-dev)")
    find_package(OpenMP QUIET COMPONENTS CXX)
    if(OpenMP_CXX_FOUND)
      set(patchrt_openmp_FOUND TRUE)
    endif()
  elseif("${component}" STREQUAL "eigen")
    set(patchrt_eigen_reason "Eigen 3.3 or later was not found (Debian: libeigen3-dev)")
    find_package(Eigen3 QUIET NO_MODULE)
    if(TARGET Eigen3::Eigen AND NOT Eigen3_VERSION VERSION_LESS 3.3)
      set(patchrt_eigen_FOUND TRUE)
    endif()
  elseif("${component}" STREQUAL "thrust")
    set(patchrt_thrust_reason "thrust/version.h was not found (CUDA toolkit, or Debian: libthrust-dev)")
    # The toolkit's copy first: Debian's beside it in one build do not mix.
    find_path(patchrt_THRUST_INCLUDE_DIR thrust/version.h HINTS /usr/local/cuda/include/cccl ENV CUDA_PATH
              PATH_SUFFIXES include/cccl)
    mark_as_advanced(patchrt_THRUST_INCLUDE_DIR)
    if(patchrt_THRUST_INCLUDE_DIR)
      set(patchrt_thrust_FOUND TRUE)
      patchrt_add_headers(patchrt_thrust_headers "${patchrt_THRUST_INCLUDE_DIR}")
    endif()
  elseif("${component}" STREQUAL "cuda")
    set(patchrt_cuda_reason "nvcc was not found (looked in PATH and /usr/local/cuda/bin; CUDACXX names another)")
    if(CMAKE_CUDA_COMPILER OR DEFINED ENV{CUDACXX})
      set(patchrt_cuda_FOUND TRUE)
    else()
      find_program(patchrt_NVCC nvcc PATHS /usr/local/cuda/bin)
      mark_as_advanced(patchrt_NVCC)
      if(patchrt_NVCC)
        set(patchrt_cuda_FOUND TRUE)
      endif()
    endif()
  else()
    set(patchrt_${component}_reason "patchrt has no such component; it has ${patchrt_components}")
  endif()
endmacro()
