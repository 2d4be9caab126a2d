set(COMMIT "unknown")
execute_process(COMMAND git -C "${SOURCE_DIR}" describe --always --dirty --abbrev=12
                OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE
                RESULT_VARIABLE failed ERROR_QUIET)
if(NOT failed)
  set(COMMIT "${described}")
endif()
configure_file("${INPUT}" "${OUTPUT}" @ONLY)
