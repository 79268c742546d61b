# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the package from BUILD below OUT, builds the consumer in SOURCE against it with CXX, and runs it on points of a known
# surface. The checkout is not on its include path, and no private header is installed. LINKER_FLAGS: the flags that sanitized
# libraries need; otherwise empty.
file(REMOVE_RECURSE ${OUT})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${OUT}/prefix OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
if(NOT EXISTS ${OUT}/prefix/include/semblance/fitting/fit.h)
  message(FATAL_ERROR "fitting/fit.h is not installed")
endif()
foreach(module least_squares space)  # internals of the solver; no public header includes them
  file(GLOB private ${OUT}/prefix/include/semblance/fitting/${module}/*)
  if(private)
    message(FATAL_ERROR "a private header is installed: ${private}")
  endif()
endforeach()
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${OUT}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_CXX_COMPILER=${CXX} "-DCMAKE_EXE_LINKER_FLAGS=${LINKER_FLAGS}" -DCMAKE_PREFIX_PATH=${OUT}/prefix OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${OUT}/build OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)

# A paraboloid over [-20, 20] x [-20, 20].
set(points "")
foreach(i RANGE -20 20)
  foreach(j RANGE -20 20)
    math(EXPR z "${i} * ${i} + ${j} * ${j}")
    string(APPEND points "${i} ${j} ${z}e-2\n")
  endforeach()
endforeach()
file(WRITE ${OUT}/points.txt "${points}")
execute_process(COMMAND ${OUT}/build/app INPUT_FILE ${OUT}/points.txt OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
message(STATUS "${output}")
if(NOT output MATCHES "^rms ([0-9.e-]+) mm, centre")
  message(FATAL_ERROR "expected 'rms NUMBER mm, centre ...'")
endif()
if(CMAKE_MATCH_1 GREATER 0.01)
  message(FATAL_ERROR "expected the surface within 0.01 mm of the points")
endif()

# fitting requires no package that only the program needs.
file(READ ${OUT}/build/CMakeCache.txt cache)
foreach(package yaml-cpp SQLite3 PNG LibArchive pugixml ICU)
  if(cache MATCHES "\n${package}_(DIR|FOUND|LIBRARY)")
    message(FATAL_ERROR "COMPONENTS fitting requires ${package}")
  endif()
endforeach()
# It is not linked to the libraries of STEP files either.
file(GLOB_RECURSE link_lines ${OUT}/build/build.ninja ${OUT}/build/link.txt)
foreach(file ${link_lines})
  file(STRINGS ${file} unneeded REGEX "TKSTEP|httplib|ITKCommon")
  if(unneeded)
    message(FATAL_ERROR "COMPONENTS fitting links libraries that it does not need: ${unneeded}")
  endif()
endforeach()
if(NOT link_lines)
  message(FATAL_ERROR "no file contains the link command of the consumer")
endif()
