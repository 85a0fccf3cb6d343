// main() of all doctest programs. A test case that neither asserts anything nor says why it is skipped fails: what
// cannot fail tests nothing.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <iostream>
#include <string>
#include <vector>

#include "tests/support/skip.h"

namespace {

constexpr int kSkipped = 77;  // SKIP_RETURN_CODE in doctest_main.cmake

/// What the test cases that ran have left undone; doctest makes its listeners itself and takes no argument for them.
struct Omissions {
  std::string test_case;  ///< at hand
  bool is_skipped = false;
  std::vector<std::string> skipped;  ///< with their reasons
  std::vector<std::string> empty;    ///< without an assertion
};

Omissions& omissions() {
  static Omissions omissions;
  return omissions;
}

struct AssertionWatch : doctest::IReporter {
  explicit AssertionWatch(const doctest::ContextOptions& /*options*/) {}

  void test_case_start(const doctest::TestCaseData& data) override {
    omissions().test_case = data.m_name;
    omissions().is_skipped = false;
  }
  void test_case_end(const doctest::CurrentTestCaseStats& stats) override {
    const bool is_empty = stats.failure_flags == 0 && stats.numAssertsCurrentTest == 0 && !omissions().is_skipped;
    if (is_empty) omissions().empty.push_back(omissions().test_case);
  }

  void report_query(const doctest::QueryData& /*data*/) override {}
  void test_run_start() override {}
  void test_run_end(const doctest::TestRunStats& /*stats*/) override {}
  void test_case_reenter(const doctest::TestCaseData& /*data*/) override {}
  void test_case_exception(const doctest::TestCaseException& /*exception*/) override {}
  void subcase_start(const doctest::SubcaseSignature& /*signature*/) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData& /*data*/) override {}
  void log_message(const doctest::MessageData& /*data*/) override {}
  void test_case_skipped(const doctest::TestCaseData& /*data*/) override {}
};

REGISTER_LISTENER("assertions", 1, AssertionWatch);

}  // namespace

void ear::test::skip(const std::string& reason) {
  omissions().is_skipped = true;
  omissions().skipped.push_back(omissions().test_case + ": " + reason);
}

int main(int argc, char** argv) {
  doctest::Context context(argc, argv);
  const int result = context.run();
  for (const std::string& what : omissions().empty) std::cerr << "asserts nothing: " << what << '\n';
  for (const std::string& what : omissions().skipped) std::cerr << "skipped: " << what << '\n';
  if (result != 0 || context.shouldExit()) return result;
  if (!omissions().empty.empty()) return 1;
  return omissions().skipped.empty() ? 0 : kSkipped;
}
