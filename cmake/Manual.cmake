# Manual pages, made at build from their templates in docs/man, and bash completion.
find_program(GZIP gzip REQUIRED)
set(MANUAL ${CMAKE_BINARY_DIR}/man)
function(weldcell_manual PAGE SECTION)
  set(OUT ${MANUAL}/${PAGE}.${SECTION})
  add_custom_command(
    OUTPUT ${OUT}.gz
    COMMAND ${CMAKE_COMMAND} -DIN=${CMAKE_SOURCE_DIR}/docs/man/${PAGE}.${SECTION}.in -DOUT=${OUT} -DVERSION=${PROJECT_VERSION} ${ARGN}
            -P ${CMAKE_SOURCE_DIR}/cmake/man_page.cmake
    COMMAND ${GZIP} -9nkf ${OUT}
    DEPENDS ${CMAKE_SOURCE_DIR}/docs/man/${PAGE}.${SECTION}.in ${CMAKE_SOURCE_DIR}/cmake/man_page.cmake ${CMAKE_SOURCE_DIR}/config/cell.yaml
            weldcell
    VERBATIM)
  set_property(GLOBAL APPEND PROPERTY WELDCELL_MANUALS ${OUT}.gz)
  install(FILES ${OUT}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man${SECTION})
endfunction()
weldcell_manual(weldcelld 8)
weldcell_manual(weldcell 1 -DWELDCELL=$<TARGET_FILE:weldcell>)
weldcell_manual(cell.yaml 5 -DSAMPLE=${CMAKE_SOURCE_DIR}/config/cell.yaml)
get_property(MANUALS GLOBAL PROPERTY WELDCELL_MANUALS)
add_custom_target(manual ALL DEPENDS ${MANUALS})
install(FILES ${CMAKE_SOURCE_DIR}/packaging/weldcell.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME weldcell)
