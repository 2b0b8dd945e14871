# Runs during the installation: the units with the installation's own paths, and the first rig file.
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(etc /etc/shakerd)
else()
  set(etc ${CMAKE_INSTALL_PREFIX}/etc/shakerd)
endif()

# Each unit twice: for the one rig of a PC (shakerd), and as a template for one rig of several
# (shakerd@RIG). They differ in names and paths alone.
function(install_units suffix)
  foreach(unit IN ITEMS shakerd.service shakerd.socket shakerd-view.socket shakerd-gateway.service
          shakerd-gateway.socket shakerd-mqtt.service shakerd-push.service shakerd-push.timer)
    string(REPLACE "." "${suffix}." installed ${unit})
    configure_file(${source}/${unit}.in ${binary}/${installed} @ONLY)
    file(INSTALL ${binary}/${installed} DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/systemd/system)
  endforeach()
endfunction()
set(rig rig)
set(shows "--rigs /run/shakerd-view")
set(which "every rig of this PC")
set(port 8420)
install_units("")
set(at "@%i")
set(sub "/%i")
set(rig "%i")
set(of " (rig %i)")
set(shows "--socket /run/shakerd-view/%i/view.sock")
set(which "the rig %i alone")
set(port 8421)
set(locks "\nReadWritePaths=/run/shakerd")
set(own_options "\nEnvironmentFile=-/etc/default/shakerd-mqtt@%i")
set(own_push "\nEnvironmentFile=-/etc/default/shakerd-push@%i")
set(topic " --rig %i")
install_units("@")

# The first rig is a simulated one, so that a first start moves nothing real. A rig file that somebody
# has written for his rig is never replaced.
if(NOT EXISTS $ENV{DESTDIR}${etc}/rig.json)
  file(INSTALL ${examples}/rig-simulated.json DESTINATION ${etc} RENAME rig.json)
  file(INSTALL ${examples}/model-oleo.json DESTINATION ${etc})
endif()
