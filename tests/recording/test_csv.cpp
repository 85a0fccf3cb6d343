#include <doctest/doctest.h>

#include "src/recording/csv.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

TEST_CASE("csv: comments, headings, blanks and both kinds of line ends") {
  const TempFolder folder;
  const fs::path file = folder / "a.csv";
  write_text(file, "timestamp,x\r\n# a comment\r\n\r\n 1 , 2.5 ,\r\n3,4");
  CsvReader csv(file);

  const CsvRow* row = csv.next();
  REQUIRE(row != nullptr);
  CHECK(row->line == 4);
  REQUIRE(row->fields.size() == 2);
  CHECK(row->fields[0] == "1");
  CHECK(row->fields[1] == "2.5");
  CHECK(row->terminated);

  row = csv.next();
  REQUIRE(row != nullptr);
  CHECK(row->line == 5);
  CHECK(row->fields[1] == "4");
  CHECK_FALSE(row->terminated);
  CHECK(csv.next() == nullptr);
}

TEST_CASE("csv: only the first row can be a heading") {
  const TempFolder folder;
  write_text(folder / "a.csv", "1,2\nx,y\n");
  CsvReader csv(folder / "a.csv");
  CHECK(csv.next() != nullptr);
  CHECK(csv.next() != nullptr);
}

TEST_CASE("csv: a missing file is an error that names it") {
  const TempFolder folder;
  CHECK(contains(input_error_of([&] { CsvReader(folder / "none.csv"); }), "none.csv"));
  CHECK(contains(input_error_of([&] { CsvReader{folder.path()}; }), folder.path().string()));  // a folder
}

TEST_CASE("csv: numbers must fill their field") {
  CHECK(parse_double("1.5e-3") == 1.5e-3);
  CHECK(parse_double("+2") == 2.0);
  CHECK(std::isnan(parse_double("nan").value()));
  CHECK(std::isnan(parse_double("NaN").value()));
  CHECK(std::isinf(parse_double("-inf").value()));
  CHECK_FALSE(parse_double(""));
  CHECK_FALSE(parse_double("1.5x"));
  CHECK(parse_integer("1403715273262142976") == 1403715273262142976);
  CHECK_FALSE(parse_integer("1.0"));
  CHECK_FALSE(parse_integer("99999999999999999999"));  // does not fit
}

TEST_CASE("csv: the last stamp is found without reading the file from its start") {
  const TempFolder folder;
  std::string text = "#t,x\n";
  for (int i = 0; i < 5000; ++i) text += std::to_string(i) + ",0\n";
  write_text(folder / "long.csv", text + "\n");
  CHECK(last_stamp(folder / "long.csv") == 4999);
  write_text(folder / "torn.csv", "#t,x\n1,2\n2,3\n3");
  CHECK(last_stamp(folder / "torn.csv") == 2);
  write_text(folder / "empty.csv", "#t,x\n");
  CHECK_FALSE(last_stamp(folder / "empty.csv"));
}
