# Manual pages, made of what the programs print with --help. Without help2man there are none.
find_program(HELP2MAN help2man)
set(programs shakerd shakerctl oleosim shakerd-stop-exciter shakerd-gateway shakerd-mqtt)
if(NOT HELP2MAN)
  message(STATUS "no help2man: no manual pages")
  return()
endif()
set(pages ${CMAKE_BINARY_DIR}/man)
set(script ${CMAKE_SOURCE_DIR}/cmake/man_pages.sh)
add_custom_command(OUTPUT ${pages}.made
  COMMAND ${script} $<TARGET_FILE_DIR:shakerctl> ${pages} ${PROJECT_VERSION}
  COMMAND ${CMAKE_COMMAND} -E touch ${pages}.made
  DEPENDS ${programs} ${script} VERBATIM)
add_custom_target(man_pages ALL DEPENDS ${pages}.made)
if(TARGET whole_system)
  add_dependencies(whole_system man_pages)
endif()
foreach(section IN ITEMS 1 8)
  install(DIRECTORY ${pages}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section}
          FILES_MATCHING PATTERN "*.${section}.gz")
endforeach()
