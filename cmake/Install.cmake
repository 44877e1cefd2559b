# `cmake --install build --prefix DIR`: the program, the libraries, their headers, and a CMake package that finds them:
#   find_package(Crumple)
#   target_link_libraries(mine PRIVATE Crumple::recon)
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(layers solvers recon tracking calib datasets)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Crumple)

# These show the types of libraries that a user of ours need not have.
file(STRINGS ${PROJECT_SOURCE_DIR}/cmake/internal_headers.txt internal_headers)
set(not_installed)
foreach(header ${internal_headers})
  list(APPEND not_installed PATTERN ${header} EXCLUDE)
endforeach()

install(TARGETS crumple RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
foreach(layer ${layers})
  install(TARGETS crumple_${layer} EXPORT CrumpleTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${layer} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/crumple
    FILES_MATCHING PATTERN "*.h" ${not_installed} PATTERN examples EXCLUDE PATTERN scenes EXCLUDE)
endforeach()
install(TARGETS crumple_options EXPORT CrumpleTargets)

install(EXPORT CrumpleTargets NAMESPACE Crumple:: DESTINATION ${package_folder})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/CrumpleConfig.cmake.in
  ${PROJECT_BINARY_DIR}/CrumpleConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/CrumpleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/CrumpleConfig.cmake ${PROJECT_BINARY_DIR}/CrumpleConfigVersion.cmake
  DESTINATION ${package_folder})
