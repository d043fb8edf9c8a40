# Files that `cmake --install` installs besides the programs, and the Debian packages that cpack builds from them.
# scripts/package.sh writes man pages and shell completion, and calls cpack.
set(shared ${CMAKE_INSTALL_DATADIR}/sqslam)
install(DIRECTORY configs DESTINATION ${shared} COMPONENT sqslam)
install(DIRECTORY assets DESTINATION ${shared} COMPONENT sqslam
  PATTERN pictures EXCLUDE
  PATTERN detectors EXCLUDE)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT sqslam)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/manual COMPONENT sqslam PATTERN examples EXCLUDE)
if(SQSLAM_BUILD_VIEWER)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sqslam-viewer RENAME copyright COMPONENT sqslam-viewer)
endif()

# The library for other projects: static libraries (sqslam_library), headers, and the files of find_package(sqslam).
include(CMakePackageConfigHelpers)
set(SQSLAM_DATA_FOLDER ${shared})
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/sqslam)
configure_package_config_file(cmake/sqslamConfig.cmake.in sqslamConfig.cmake
  INSTALL_DESTINATION ${package_folder} PATH_VARS SQSLAM_DATA_FOLDER)
write_basic_package_version_file(sqslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sqslamConfig.cmake ${PROJECT_BINARY_DIR}/sqslamConfigVersion.cmake
  cmake/data_folder.cpp DESTINATION ${package_folder} COMPONENT libsqslam-dev)
install(EXPORT sqslamTargets NAMESPACE sqslam:: DESTINATION ${package_folder} COMPONENT libsqslam-dev)
install(DIRECTORY slam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sqslam COMPONENT libsqslam-dev
  FILES_MATCHING PATTERN *.h)
if(SQSLAM_BUILD_PROGRAMS)
  install(DIRECTORY render DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sqslam COMPONENT libsqslam-dev
    FILES_MATCHING PATTERN *.h)
endif()
install(DIRECTORY docs/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libsqslam-dev COMPONENT libsqslam-dev)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libsqslam-dev RENAME copyright COMPONENT libsqslam-dev)

set(parts sqslam)
if(SQSLAM_BUILD_VIEWER)
  list(APPEND parts sqslam-viewer)
endif()
list(APPEND parts libsqslam-dev)
if(TARGET sqslam_python)
  list(APPEND parts python3-sqslam)
  get_target_property(python sqslam_python SQSLAM_PYTHON_MINOR)  # the module is built for this version
  math(EXPR next_python "${python} + 1")
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-sqslam RENAME copyright COMPONENT python3-sqslam)
endif()
foreach(part ${parts})  # man, bash-completion, zsh, doc/changelog, if scripts/package.sh has written them
  install(DIRECTORY ${PROJECT_BINARY_DIR}/package/${part}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT ${part} OPTIONAL)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the sqslam authors <maintainers@sqslam.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL ${parts})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SQSLAM_PACKAGE_NAME sqslam)
set(CPACK_DEBIAN_SQSLAM_PACKAGE_DEPENDS "fonts-dejavu-core, libjs-three")
set(CPACK_DEBIAN_SQSLAM_PACKAGE_RECOMMENDS "sqslam-viewer")
set(CPACK_COMPONENT_SQSLAM_DESCRIPTION "Takes a video of one camera and gives the camera's path, a point cloud, and
 every object as a superquadric; draws the map without a display.")
set(CPACK_DEBIAN_SQSLAM-VIEWER_PACKAGE_NAME sqslam-viewer)
set(CPACK_DEBIAN_SQSLAM-VIEWER_PACKAGE_DEPENDS "sqslam (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_SQSLAM-VIEWER_DESCRIPTION "The desktop viewer: shows maps of sqslam while they are made
 and afterwards, and edits their objects.")
set(CPACK_DEBIAN_LIBSQSLAM-DEV_PACKAGE_NAME libsqslam-dev)
set(CPACK_DEBIAN_LIBSQSLAM-DEV_PACKAGE_SECTION libdevel)
# The packages of packages.txt that the targets of cmake/sqslamConfig.cmake.in link.
string(CONCAT CPACK_DEBIAN_LIBSQSLAM-DEV_PACKAGE_DEPENDS "sqslam (= ${PROJECT_VERSION}), "
  "libeigen3-dev, libceres-dev, libopencv-dev, libopencv-contrib-dev, libavformat-dev, libavcodec-dev, libswscale-dev, "
  "libexif-dev, libvtk9-dev, libosmesa6-dev, libegl-dev, libgl-dev, libcairo2-dev, libfontconfig-dev, libyaml-cpp-dev, "
  "nlohmann-json3-dev, libspdlog-dev, libfmt-dev, libsqlite3-dev, zlib1g-dev, libzstd-dev, libboost-dev, libnanoflann-dev, pkg-config")
if(ONNXRUNTIME_LIBRARY MATCHES "^/usr/lib/")
  string(APPEND CPACK_DEBIAN_LIBSQSLAM-DEV_PACKAGE_DEPENDS ", libonnxruntime-dev")
endif()
set(CPACK_COMPONENT_LIBSQSLAM-DEV_DESCRIPTION "The library of sqslam for programs in C++: headers, archives and
 what find_package(sqslam) of CMake needs.")
set(CPACK_DEBIAN_PYTHON3-SQSLAM_PACKAGE_NAME python3-sqslam)
set(CPACK_DEBIAN_PYTHON3-SQSLAM_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON3-SQSLAM_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/prerm)
set(CPACK_DEBIAN_PYTHON3-SQSLAM_PACKAGE_DEPENDS "sqslam (= ${PROJECT_VERSION}), python3 (<< 3.${next_python}), python3 (>= 3.${python}~), python3-numpy")
set(CPACK_COMPONENT_PYTHON3-SQSLAM_DESCRIPTION "Results of sqslam in Python: poses, points, objects and every state
 as NumPy arrays; fits superquadrics to clouds, draws maps into arrays.")
include(CPack)
