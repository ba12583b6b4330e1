# The headers and their package configuration: find_package(armangle CONFIG) gives armangle::armangle.
# In a wheel both lie within the Python package, so that an environment carries them; nothing in them is absolute.
include(CMakePackageConfigHelpers)

if(SKBUILD)
  set(include_dir armangle/include)
  set(config_dir armangle/cmake)
else()
  include(GNUInstallDirs)
  set(include_dir ${CMAKE_INSTALL_INCLUDEDIR})
  set(config_dir ${CMAKE_INSTALL_DATAROOTDIR}/cmake/armangle)
endif()

install(TARGETS armangle EXPORT armangleTargets INCLUDES DESTINATION ${include_dir})
install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/include/armangle DESTINATION ${include_dir} FILES_MATCHING PATTERN "*.hpp")
install(EXPORT armangleTargets NAMESPACE armangle:: DESTINATION ${config_dir})
configure_package_config_file(${CMAKE_CURRENT_SOURCE_DIR}/cmake/armangleConfig.cmake.in
                              ${CMAKE_CURRENT_BINARY_DIR}/armangleConfig.cmake INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/armangleConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/armangleConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/armangleConfigVersion.cmake
        DESTINATION ${config_dir})
