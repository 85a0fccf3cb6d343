# cmake -DPROGRAM=test_asserts_nothing -P expect_skip.cmake: the skipped case alone must end with 77 and its reason.
execute_process(COMMAND ${PROGRAM} "--test-case=*skipped*" RESULT_VARIABLE result ERROR_VARIABLE said)
if(NOT result EQUAL 77 OR NOT said MATCHES "skipped: .*: to see that it is reported")
  message(FATAL_ERROR "ended with ${result} and said: ${said}")
endif()
