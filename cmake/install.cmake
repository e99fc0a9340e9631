# SPDX-License-Identifier: MIT
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_dir ${CMAKE_INSTALL_DATADIR}/cmake/patchrt)
install(DIRECTORY include/patchrt DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(TARGETS patchrt EXPORT patchrt-targets)
install(EXPORT patchrt-targets NAMESPACE patchrt:: DESTINATION ${package_dir})
# One export set a component, so that asking for one needs the packages of no other.
foreach(component IN LISTS patchrt_components)
  install(TARGETS patchrt_${component} EXPORT patchrt-${component}-targets)
  install(EXPORT patchrt-${component}-targets NAMESPACE patchrt:: DESTINATION ${package_dir})
endforeach()
configure_package_config_file(cmake/patchrt-config.cmake.in patchrt-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(patchrt-config-version.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/patchrt-config.cmake ${PROJECT_BINARY_DIR}/patchrt-config-version.cmake
              ${PROJECT_SOURCE_DIR}/cmake/patchrt-components.cmake DESTINATION ${package_dir})
