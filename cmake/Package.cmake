# CPack: weldcell_VERSION_ARCH.deb, by scripts/package. The configuration in /etc/weldcell is a set of conffiles.
set(PACKAGING ${CMAKE_SOURCE_DIR}/packaging/debian)
file(GLOB DOCUMENTS CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/docs/*.md)
file(GLOB ROBOTS RELATIVE ${CMAKE_SOURCE_DIR}/config CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/config/robots/*.yaml)
set(CONFFILES /etc/weldcell/cell.yaml)
foreach(ROBOT IN LISTS ROBOTS)
  list(APPEND CONFFILES /etc/weldcell/${ROBOT})
endforeach()
list(JOIN CONFFILES "\n" CONFFILES)
file(WRITE ${CMAKE_BINARY_DIR}/package/conffiles "${CONFFILES}\n")
execute_process(COMMAND gzip -9nc ${CMAKE_SOURCE_DIR}/CHANGELOG.md OUTPUT_FILE ${CMAKE_BINARY_DIR}/package/changelog.gz)

# Only in the package: `cmake --install` writes nothing into /etc.
set(PACKAGE_ONLY COMPONENT package EXCLUDE_FROM_ALL)
install(FILES ${CMAKE_SOURCE_DIR}/config/cell.yaml DESTINATION /etc/weldcell ${PACKAGE_ONLY})
install(DIRECTORY ${CMAKE_SOURCE_DIR}/config/robots DESTINATION /etc/weldcell ${PACKAGE_ONLY} FILES_MATCHING PATTERN "*.yaml")
install(FILES ${PACKAGING}/copyright ${CMAKE_BINARY_DIR}/package/changelog.gz ${DOCUMENTS} DESTINATION /usr/share/doc/weldcell ${PACKAGE_ONLY})
# The bill of materials is made when the package is: of what this machine really compiled and linked.
install(CODE "execute_process(COMMAND ${CMAKE_SOURCE_DIR}/scripts/sbom --build ${CMAKE_BINARY_DIR}
                OUTPUT_FILE ${CMAKE_BINARY_DIR}/package/weldcell.spdx.json COMMAND_ERROR_IS_FATAL ANY)" ${PACKAGE_ONLY})
install(FILES ${CMAKE_BINARY_DIR}/package/weldcell.spdx.json DESTINATION /usr/share/doc/weldcell ${PACKAGE_ONLY})
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs/examples DESTINATION /usr/share/doc/weldcell ${PACKAGE_ONLY})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME weldcell)
set(CPACK_PACKAGE_CONTACT "weldcell developers <weldcell@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "real-time controller for a weld cell without fixtures")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "\
Shows a worker where the members of a flat weldment go, scans what was laid
down with a laser on an ABB robot, finds its pose and moves the welds there.
Holds the daemon weldcelld, its command line, a simulator of the whole cell
and a reader of STEP and DXF drawings.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL Unspecified package)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION electronics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd (>= 252), init-system-helpers (>= 1.52), procps, fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "bash-completion")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/package/conffiles ${PACKAGING}/postinst ${PACKAGING}/prerm
    ${PACKAGING}/postrm)
include(CPack)
