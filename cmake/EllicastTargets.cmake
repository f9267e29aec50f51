# Compile settings shared by every target of the project.
add_library(ellicast_settings INTERFACE)
target_include_directories(ellicast_settings INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(ellicast_settings INTERFACE
  -Wall -Wextra -Wshadow -Wconversion -Wpedantic -Werror
  # Fused multiply-add and reassociation would make results depend on the compiler's mood.
  -ffp-contract=off
  # GCC 12 at -O2 drops double -> float -> double when it joins neighbouring scalars into a vector, so
  # that a value rounded to float32 comes back unrounded (tests/sender/broadcast_object_test.cpp sees it).
  $<$<CXX_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>)
if(ELLICAST_SANITIZE)
  target_compile_options(ellicast_settings INTERFACE
    -fsanitize=${ELLICAST_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(ellicast_settings INTERFACE -fsanitize=${ELLICAST_SANITIZE})
  if(ELLICAST_SANITIZE MATCHES thread AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Asio's fences, of which it knows nothing; they guard handlers that one thread runs here.
    target_compile_options(ellicast_settings INTERFACE -Wno-tsan)
  endif()
endif()

# What nearly every file reads, read once. For whoever builds from nothing; a compiler cache has no use for it.
set(ELLICAST_COMMON_HEADERS <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <functional> <map>
  <memory> <optional> <span> <string> <vector>)
function(ellicast_precompile name)
  if(ELLICAST_PRECOMPILE)
    target_precompile_headers(${name} PRIVATE ${ELLICAST_COMMON_HEADERS} ${ARGN})
  endif()
endfunction()

# ellicast_library(name SOURCES... [PUBLIC deps...] [PRIVATE deps...])
function(ellicast_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ellicast_settings ${ARG_PRIVATE})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
endfunction()
