# generated/mocapkit_version.hpp: project version and git commit, rewritten at build time only when the commit changes,
# so that a rebuild after a commit compiles one file.
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/generated)
add_custom_target(mocapkit_version ALL
  COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR} -DOUT=${CMAKE_BINARY_DIR}/generated/mocapkit_version.hpp
          -DVERSION=${PROJECT_VERSION} -P ${CMAKE_SOURCE_DIR}/cmake/WriteVersion.cmake
  BYPRODUCTS ${CMAKE_BINARY_DIR}/generated/mocapkit_version.hpp)
execute_process(COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR} -DOUT=${CMAKE_BINARY_DIR}/generated/mocapkit_version.hpp
  -DVERSION=${PROJECT_VERSION} -P ${CMAKE_SOURCE_DIR}/cmake/WriteVersion.cmake)
