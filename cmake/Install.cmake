# cmake --install: programs, configuration samples, systemd unit.
include(GNUInstallDirs)
foreach(PROGRAM weldcelld weldcell weldcell-sim weldcell-cad)
  if(TARGET ${PROGRAM})
    install(TARGETS ${PROGRAM} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endforeach()
install(DIRECTORY ${CMAKE_SOURCE_DIR}/config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/weldcell)
install(FILES ${CMAKE_SOURCE_DIR}/systemd/weldcelld.service DESTINATION lib/systemd/system OPTIONAL)
