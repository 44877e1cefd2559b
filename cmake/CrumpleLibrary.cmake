# One library per folder. Every .cc below the folder belongs to it, so a new concept is a new file and nothing else.
function(crumple_library name)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE;SYSTEM_PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cc)
  add_library(crumple_${name} STATIC ${sources})
  add_library(Crumple::${name} ALIAS crumple_${name})
  set_target_properties(crumple_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(crumple_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/crumple>)
  target_link_libraries(crumple_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} crumple_options)
  # Third-party headers are not held to our warnings.
  foreach(package ${ARG_SYSTEM_PRIVATE})
    target_link_libraries(crumple_${name} PRIVATE ${package})
  endforeach()
endfunction()
