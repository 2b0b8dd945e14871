# Runs during the installation: the unit with the installation's own paths, and the first rig file.
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(etc /etc/shakerd)
else()
  set(etc ${CMAKE_INSTALL_PREFIX}/etc/shakerd)
endif()
foreach(unit IN ITEMS shakerd shakerd-gateway shakerd-mqtt)
  configure_file(${source}/${unit}.service.in ${binary}/${unit}.service @ONLY)
  file(INSTALL ${binary}/${unit}.service DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/systemd/system)
endforeach()

# The first rig is a simulated one, so that a first start moves nothing real. A rig file that somebody
# has written for his rig is never replaced.
if(NOT EXISTS $ENV{DESTDIR}${etc}/rig.json)
  file(INSTALL ${examples}/rig-simulated.json DESTINATION ${etc} RENAME rig.json)
  file(INSTALL ${examples}/model-oleo.json DESTINATION ${etc})
endif()
