# What `cmake --install` puts in place, and the Debian packages (cpack -G DEB) that carry the same:
# shakerd, and python3-shakerd for clients in Python.
include(GNUInstallDirs)

foreach(program IN ITEMS shakerd shakerctl shakerctl-analysis shakerctl-diagnosis shakerctl-push oleosim
        shakerd-stop-exciter shakerd-gateway shakerd-mqtt)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
    set(folder ${CMAKE_INSTALL_BINDIR})
    if(program MATCHES "^shakerctl-")  # only shakerctl and shakerd call them
      set(folder ${CMAKE_INSTALL_LIBEXECDIR}/shakerd)
    endif()
    install(TARGETS ${program} RUNTIME DESTINATION ${folder})
  endif()
endforeach()

install(FILES README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "*.md"
        PATTERN "*.svg" PATTERN "*.webp")
install(FILES web/vendor/uplot/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME LICENSE.uPlot)
install(FILES gateway/grafana-dashboard.json DESTINATION ${CMAKE_INSTALL_DATADIR}/shakerd)
install(DIRECTORY config/examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/shakerd/examples)
# Both have a rig.schema.json: of the rig file, and of the stream's document.
install(DIRECTORY config/schema/ DESTINATION ${CMAKE_INSTALL_DATADIR}/shakerd/schema)
install(DIRECTORY protocol/schema/ DESTINATION ${CMAKE_INSTALL_DATADIR}/shakerd/schema/stream)

# The library for other programs, which examples/ use: find_package(Shaker COMPONENTS estimator
# estimate diagnosis), or pkg-config. It is not in the rig PC's package.
set(shaker_installed base config math signal model solve integration fit records inference online estimator estimate
                     diagnosis_campaign diagnosis)
foreach(room IN LISTS shaker_installed)
  set_target_properties(shaker_${room} PROPERTIES EXPORT_NAME ${room})
  install(TARGETS shaker_${room} EXPORT Shaker ARCHIVE COMPONENT development)
endforeach()
file(STRINGS cmake/public_headers.txt shaker_public_headers REGEX "^INPUT ")
list(TRANSFORM shaker_public_headers REPLACE "^INPUT \\+= " "")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS cmake/public_headers.txt)
foreach(header IN LISTS shaker_public_headers)
  cmake_path(GET header PARENT_PATH folder)
  install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/shaker/${folder}
          COMPONENT development)
endforeach()
include(CMakePackageConfigHelpers)
set(shaker_package ${CMAKE_INSTALL_LIBDIR}/cmake/Shaker)
install(EXPORT Shaker NAMESPACE Shaker:: FILE ShakerTargets.cmake DESTINATION ${shaker_package}
        COMPONENT development)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/ShakerConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES cmake/ShakerConfig.cmake ${CMAKE_BINARY_DIR}/ShakerConfigVersion.cmake
        DESTINATION ${shaker_package} COMPONENT development)
# shaker_pkg_config(NAME DESCRIPTION LIBRARIES...): a library of another project is written as -lNAME.
function(shaker_pkg_config name description)
  list(TRANSFORM ARGN PREPEND -lshaker_ REGEX "^[a-z]" OUTPUT_VARIABLE libraries)
  list(JOIN libraries " " libraries)
  file(RELATIVE_PATH up /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
  configure_file(cmake/shaker.pc.in ${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc COMPONENT development
          DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()
shaker_pkg_config(shaker-estimator "Parameters of a damper from its periodic response"
                  online inference fit solve model math config base)
shaker_pkg_config(shaker-estimate "All that shakerctl estimate does between runs and an estimate"
                  estimate records integration inference fit solve model math config base
                  -lsundials_cvodes -lsundials_nvecserial -lsundials_sunmatrixdense -lsundials_sunlinsoldense
                  -lsundials_sunnonlinsolfixedpoint)
shaker_pkg_config(shaker-diagnosis "Names the effect that a damper's model lacks"
                  diagnosis diagnosis_campaign signal solve model math config base)

install(DIRECTORY python/shakerd DESTINATION lib/python3/dist-packages COMPONENT python
        FILES_MATCHING PATTERN "*.py" PATTERN py.typed)
install(FILES python/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-shakerd
        COMPONENT python)

set(CPACK_COMPONENTS_ALL runtime python)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGE_NAME shakerd)
set(CPACK_PACKAGE_CONTACT "The rig's maintainers <root@localhost>")
set(CPACK_PACKAGE_DESCRIPTION
    "shakerd drives a harmonic excitation of a damper under test over Modbus or CAN, acquires the
stroke, cuts it into whole periods and fits a physical model to each by its periodic solution.
Estimates with their intervals leave as JSON lines on a Unix socket; every raw sample is kept in an
SQLite database. shakerctl is the operator's hand, oleosim a rig that is not there.")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME shakerd)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "systemd (>= 252)")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "can-utils, iproute2")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA
    ${CMAKE_SOURCE_DIR}/cmake/debian/conffiles ${CMAKE_SOURCE_DIR}/cmake/debian/postinst
    ${CMAKE_SOURCE_DIR}/cmake/debian/prerm ${CMAKE_SOURCE_DIR}/cmake/debian/postrm)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-shakerd)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.9)")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "shakerd")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION
    "These are the clients in Python: they follow a rig, run campaigns, read what was recorded,
estimate and diagnose. NumPy is used where it is installed.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${CMAKE_SOURCE_DIR}/cmake/debian/python/postinst
                                              ${CMAKE_SOURCE_DIR}/cmake/debian/python/prerm)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
