// The one file that the page of `consac twin view` may write: by whom, over what, and what is no hints.
#include "cli/twin_hints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "tests/support.h"

namespace consac::cli {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr const char* kJoint = R"({"joints": [{"name": "elbow", "parent": "a", "child": "b", "axis": "auto"}]})";

class TwinHintsTest : public ::testing::Test {
 protected:
  Json Page() const { return Json::parse(hints_.Text("{}")); }
  Result<std::string> Ask(const Json& page, const char* hints) const {
    return hints_.Asked(
        Json{{"token", page["token"]}, {"version", page["version"]}, {"hints", Json::parse(hints)}}.dump());
  }
  void Write(const std::string& text) const { std::ofstream(path_) << text; }

  testing::ScratchFolder scratch_{"hints"};
  const std::string path_ = scratch_.path() + "/hints.json";
  const TwinHints hints_{path_};
};

TEST_F(TwinHintsTest, WhatThePageAsksForIsSavedAndReadAgain) {
  const Result<std::string> asked = Ask(Page(), kJoint);
  ASSERT_TRUE(asked.ok()) << asked.status().message();
  ASSERT_TRUE(hints_.Save(*asked).ok());
  EXPECT_EQ(Page()["hints"], Json::parse(kJoint));
}

TEST_F(TwinHintsTest, WhoDoesNotKnowTheTokenSavesNothing) {
  Json page = Page();
  page["token"] = "x";
  EXPECT_EQ(Ask(page, kJoint).status().code(), StatusCode::kFailedPrecondition);
}

TEST_F(TwinHintsTest, AFileThatHasChangedIsNotWrittenOver) {
  const Json page = Page();
  Write(R"({"base": "by hand"})");
  const Status refused = Ask(page, kJoint).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_THAT(refused.message(), HasSubstr("has changed since this page read it"));
  EXPECT_TRUE(Ask(Page(), kJoint).ok()) << "a page that is loaded anew knows it";
}

TEST_F(TwinHintsTest, WhatCannotBeReadIsNotWrittenOver) {
  Write(R"({"base": "half)");
  const Json page = Page();
  EXPECT_FALSE(page.contains("token"));
  EXPECT_TRUE(page.contains("error"));
}

TEST_F(TwinHintsTest, WhatIsNoHintsIsRefused) {
  EXPECT_EQ(Ask(Page(), R"({"joints": 5})").status().code(), StatusCode::kInvalidArgument);
  EXPECT_FALSE(hints_.Asked("[").ok());
}

}  // namespace
}  // namespace consac::cli
