// Numbers as Python's str() writes them; the texts are CPython 3.11's and NumPy 1.24's.
#include "consac/learn/log/row.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "consac/base/rng.h"

namespace consac::learn {
namespace {

std::string Text(double value, CellKind kind = CellKind::kDouble) {
  return ExactText({"", value, kind});
}

TEST(Row, NumbersAsPythonAndNumpyWriteThem) {
  EXPECT_EQ(Text(1.0), "1.0");
  EXPECT_EQ(Text(0.1), "0.1");
  EXPECT_EQ(Text(-0.0), "-0.0");
  EXPECT_EQ(Text(100000.0), "100000.0");
  EXPECT_EQ(Text(1e15), "1000000000000000.0");
  EXPECT_EQ(Text(1e16), "1e+16");
  EXPECT_EQ(Text(1152921504606846976.0), "1.152921504606847e+18") << "not the digits of the whole number";
  EXPECT_EQ(Text(123456789.0), "123456789.0");
  EXPECT_EQ(Text(123456789.25), "123456789.25");
  EXPECT_EQ(Text(0.0001), "0.0001");
  EXPECT_EQ(Text(0.00001), "1e-05");
  EXPECT_EQ(Text(-1.7976931348623157e308), "-1.7976931348623157e+308");
  EXPECT_EQ(Text(5e-324), "5e-324");
  EXPECT_EQ(Text(0.1, CellKind::kSingle), "0.1");
  EXPECT_EQ(Text(1e8, CellKind::kSingle), "100000000.0");
  EXPECT_EQ(Text(12345678848.0, CellKind::kSingle), "12345679000.0");
  EXPECT_EQ(Text(-7.9, CellKind::kInteger), "-7");
  EXPECT_EQ(Text(9007199254740993.0, CellKind::kInteger), "9007199254740992");
  EXPECT_EQ(Text(std::numeric_limits<double>::quiet_NaN(), CellKind::kSingle), "nan");
  EXPECT_EQ(Text(-std::numeric_limits<double>::infinity()), "-inf");
}

// Shortest and exact, of any size.
TEST(Row, ANumberReadsBackAsItself) {
  Rng rng(7, 1);
  for (int k = 0; k < 20000; ++k) {
    const double value = std::ldexp(rng.Between(-1.0, 1.0), static_cast<int>(rng.Between(-60.0, 60.0)));
    const std::string text = Text(value);
    EXPECT_EQ(std::strtod(text.c_str(), nullptr), value) << text;
    EXPECT_LE(text.size(), 24u) << text;
  }
}

TEST(Row, KeysWithoutASectionComeFirst) {
  Row row = {{"train/loss", 1.0}, {"fps", 2.0}, {"game/goals", 3.0}, {"approxkl", 4.0}};
  SortByKey(&row);
  EXPECT_EQ(row[0].key, "approxkl");
  EXPECT_EQ(row[1].key, "fps");
  EXPECT_EQ(row[2].key, "game/goals");
  EXPECT_EQ(row[3].key, "train/loss");
}

}  // namespace
}  // namespace consac::learn
