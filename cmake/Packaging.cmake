# What `cmake --install` puts under a prefix beside the programs, and the Debian packages that cpack makes of it.
# scripts/package.sh writes the man pages and the completion of shells, and calls cpack.
set(shared ${CMAKE_INSTALL_DATADIR}/sqslam)
install(DIRECTORY configs DESTINATION ${shared} COMPONENT sqslam)
install(DIRECTORY assets DESTINATION ${shared} COMPONENT sqslam
  PATTERN pictures EXCLUDE
  PATTERN detectors EXCLUDE)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT sqslam)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/manual COMPONENT sqslam)
if(SQSLAM_BUILD_VIEWER)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sqslam-viewer RENAME copyright COMPONENT sqslam-viewer)
endif()
foreach(part sqslam sqslam-viewer)  # man, bash-completion, zsh, doc/changelog: there once scripts/package.sh has run
  install(DIRECTORY ${PROJECT_BINARY_DIR}/package/${part}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT ${part} OPTIONAL)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the sqslam authors <maintainers@sqslam.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL sqslam sqslam-viewer)
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
include(CPack)
