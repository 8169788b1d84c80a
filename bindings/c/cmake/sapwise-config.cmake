# The targets sapwise::sapwise (shared) and sapwise::sapwise-static, for find_package(sapwise).
get_filename_component(_sapwise_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
set(_sapwise_where HINTS "${_sapwise_prefix}" NO_DEFAULT_PATH)
set(_sapwise_lib lib lib64 "lib/${CMAKE_LIBRARY_ARCHITECTURE}" bin)
find_path(SAPWISE_INCLUDE_DIR sapwise.h ${_sapwise_where} PATH_SUFFIXES include)
find_library(SAPWISE_STATIC_LIBRARY NAMES libsapwise.a ${_sapwise_where} PATH_SUFFIXES ${_sapwise_lib})
set(_sapwise_suffixes ${CMAKE_FIND_LIBRARY_SUFFIXES})
set(CMAKE_FIND_LIBRARY_SUFFIXES .so .dylib .dll.a .lib)
find_library(SAPWISE_LIBRARY NAMES sapwise sapwise.dll ${_sapwise_where} PATH_SUFFIXES ${_sapwise_lib})
set(CMAKE_FIND_LIBRARY_SUFFIXES ${_sapwise_suffixes})

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(sapwise REQUIRED_VARS SAPWISE_LIBRARY SAPWISE_INCLUDE_DIR
  VERSION_VAR sapwise_VERSION)
if(sapwise_FOUND AND NOT TARGET sapwise::sapwise)
  add_library(sapwise::sapwise UNKNOWN IMPORTED)
  set_target_properties(sapwise::sapwise PROPERTIES
    IMPORTED_LOCATION "${SAPWISE_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${SAPWISE_INCLUDE_DIR}")
  if(SAPWISE_STATIC_LIBRARY)
    find_package(Threads REQUIRED)
    add_library(sapwise::sapwise-static STATIC IMPORTED)
    set_target_properties(sapwise::sapwise-static PROPERTIES
      IMPORTED_LOCATION "${SAPWISE_STATIC_LIBRARY}"
      INTERFACE_INCLUDE_DIRECTORIES "${SAPWISE_INCLUDE_DIR}"
      INTERFACE_LINK_LIBRARIES "Threads::Threads;${CMAKE_DL_LIBS};m")
  endif()
endif()
mark_as_advanced(SAPWISE_INCLUDE_DIR SAPWISE_LIBRARY SAPWISE_STATIC_LIBRARY)
