// spec/conformance/names/specs.json: what a SPEC may be called and may cost. python/tests/test_offer.py reads the
// same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "consac/base/rng.h"
#include "consac/protocol/protocol2.h"
#include "consac/space/layout.h"
#include "space/space_json.h"

namespace consac::protocol2 {
namespace {

using CaseJson = nlohmann::json;

TEST(SpecCases, EveryOneIsTakenOrRefusedAsItSays) {
  std::ifstream file(std::string(CONSAC_SOURCE_DIR) + "/spec/conformance/names/specs.json");
  const CaseJson all = CaseJson::parse(file, nullptr, false);
  ASSERT_GT(all["cases"].size(), 30u);
  for (const CaseJson& one : all["cases"]) {
    CaseJson spec = all["spec"];
    if (one.contains("spec")) spec.update(one["spec"]);
    const CaseJson changes = one.contains("behaviours") ? one["behaviours"] : CaseJson::array({CaseJson::object()});
    for (const CaseJson& change : changes) {
      spec["behaviours"].push_back(all["behaviour"]);
      spec["behaviours"].back().update(change);
    }
    const std::string text = spec.dump();
    const Status status = ParseSpec(std::as_bytes(std::span(text))).status();
    SCOPED_TRACE(one["name"]);
    EXPECT_EQ(status.ok(), !one.contains("refused")) << status.message();
    if (status.ok()) continue;
    EXPECT_EQ(FaultName(status), "MALFORMED");
    EXPECT_THAT(status.message(), ::testing::HasSubstr(one["refused"].get<std::string>()));
  }
}

TEST(SpecBounds, BeyondTheTypeAreItsEndsAlsoForWhoDraws) {
  struct {
    const char *dtype, *low, *high;
    double drawn;
  } const cases[] = {{"U8", "300", "400", 255.0},
                     {"BOOL", "1", "7", 1.0},
                     {"I8", "-400", "-300", -128.0},
                     {"F32", "1.00000001", "1", 1.0}};
  for (const auto& one : cases) {
    const std::string text = std::string(R"({"type":"box","shape":[2],"dtype":")") + one.dtype + R"(","low":)" +
                             one.low + R"(,"high":)" + one.high + "}";
    MemoryBudget budget(1 << 20);
    const Result<Space> space = SpaceFromJson(CaseJson::parse(text), budget);
    ASSERT_TRUE(space.ok()) << space.status().message();
    const Layout layout = Layout::Of(*space);
    std::vector<std::byte> row(layout.row_bytes);
    Rng rng(1, 1);
    SampleRow(layout, rng, row.data());
    EXPECT_EQ(ReadElement(layout.leaves[0], row.data(), 1), one.drawn) << text;
    EXPECT_TRUE(CheckRow(layout, row.data()).ok());
  }
}

TEST(ExpectedNames, AreJudgedThoughTheyAreOnlyCompared) {
  const auto judged = [](const std::string& expect) {
    const std::string text = R"({"expect":)" + expect + "}";
    return ParseConfigure(std::as_bytes(std::span(text))).status();
  };
  EXPECT_TRUE(judged(R"([{"name":"L\u00e4ufer","agents":["a",7],"observation":{"spaces":[{"name":"x/y"}]}}])").ok());
  for (const char* expect : {R"([{"name":"a\u001b[2J"}])", R"([{"name":""}])", R"([{"agents":["a","b\n"]}])",
                             R"([{"observation":{"spaces":[{"space":{"spaces":[{"name":"\u202e"}]}}]}}])"}) {
    EXPECT_EQ(FaultName(judged(expect)), "MALFORMED") << expect;
    EXPECT_THAT(judged(expect).message(), ::testing::HasSubstr("expected")) << expect;
  }
}

}  // namespace
}  // namespace consac::protocol2
