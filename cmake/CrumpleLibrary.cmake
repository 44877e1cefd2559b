# The header that the libraries have precompiled, once for all of them.
add_library(crumple_precompiled OBJECT ${CMAKE_CURRENT_LIST_DIR}/precompiled.cc)
target_precompile_headers(crumple_precompiled PRIVATE ${CMAKE_CURRENT_LIST_DIR}/precompiled.h)
target_include_directories(crumple_precompiled PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(crumple_precompiled PRIVATE Eigen3::Eigen tl::expected fmt::fmt crumple_options)

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
  target_precompile_headers(crumple_${name} REUSE_FROM crumple_precompiled)
  # Third-party headers are not held to our warnings.
  foreach(package ${ARG_SYSTEM_PRIVATE})
    target_link_libraries(crumple_${name} PRIVATE ${package})
  endforeach()
endfunction()
