# SPDX-License-Identifier: MIT
execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
file(READ ${EXPECTED} expected)
if(NOT printed STREQUAL expected)
  message(FATAL_ERROR "README.md says that its program prints\n${expected}but it prints\n${printed}")
endif()
