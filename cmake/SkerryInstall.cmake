include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(DIRECTORY include/skerry DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")

# Two export sets: a project that wants skerry::jobs alone needs oneTBB and nothing else.
install(TARGETS skerry_jobs EXPORT skerry-jobs ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS skerry_core skerry_collision skerry_solver skerry_pipeline skerry_engine
        EXPORT skerry-engine ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/skerry)
install(EXPORT skerry-jobs NAMESPACE skerry:: DESTINATION ${config_dir})
install(EXPORT skerry-engine NAMESPACE skerry:: DESTINATION ${config_dir})

configure_package_config_file(cmake/skerry-config.cmake.in
  "${CMAKE_CURRENT_BINARY_DIR}/skerry-config.cmake" INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/skerry-config-version.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/skerry-config.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/skerry-config-version.cmake"
        DESTINATION ${config_dir})

if(TARGET skerry_app)
  install(TARGETS skerry_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
