# The Debian package: `cpack -G DEB` in the build folder. docs/embedding.md, section "Debian package".
set(CPACK_PACKAGE_NAME ear-msckf)
set(CPACK_PACKAGE_VENDOR "EAR-MSCKF")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)  # the program; the libraries are archives
set(CPACK_GENERATOR DEB)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "EAR-MSCKF developers <ear-msckf@localhost>")
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # what the program needs to run
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libeigen3-dev, libopencv-dev, libspdlog-dev")  # what programs that embed the library need to build
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
    "Estimates where a vehicle is that drives and flies, from a stereo camera, an
IMU, wheel encoders and lasers. Holds the program ear, and the library with its
headers for programs in C++ and C.")

# The Python module is a package of its own, python3-ear: it needs Python, and nothing of the other one.
if(TARGET ear_python)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_COMPONENTS_ALL Unspecified python)
  set(CPACK_DEBIAN_UNSPECIFIED_PACKAGE_NAME ${CPACK_PACKAGE_NAME})
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-ear)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "")
  math(EXPR next_python "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS  # the module is for this version of Python
      "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${Python_VERSION_MAJOR}.${next_python}), python3-numpy")
  set(CPACK_COMPONENT_UNSPECIFIED_DESCRIPTION "${CPACK_DEBIAN_PACKAGE_DESCRIPTION}")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
      "Estimates where a vehicle is that drives and flies: the Python module ear,
with recordings, the simulator and the evaluation.")
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-ear RENAME copyright
          COMPONENT python)
endif()

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_PACKAGE_NAME}
        RENAME copyright)
include(CPack)
