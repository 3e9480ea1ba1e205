#include "tests/slow/proofs_page.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>

namespace consac {
namespace {

using proofs::Outcome;
using proofs::Page;
using proofs::Proof;

Proof Cart() {
  return {"cart by a", "cart-v1", "a", 100, 8, false, "", {{"gamma", "0.9"}}, 9, 8, 4};
}

std::string Written(const std::vector<Proof>& rows, const Page& page) {
  std::ostringstream out;
  proofs::WritePage(out, rows, page);
  return out.str();
}

Page ReadBack(const std::string& text) {
  std::istringstream in(text);
  return proofs::ReadPage(in);
}

TEST(ProofsPage, KeepsWhatWasRunAndNotesWhoeverTheRowIsCalled) {
  Page page{{{proofs::RunOf(Cart()), {{9, 10, 8.125, -11.5, 12}, 1.5}}}, "\nBy hand.\n"};
  const std::string text = Written({Cart()}, page);
  EXPECT_NE(
      text.find("| cart by a | cart-v1 | a | 100 x 8 | 9, 10, 8.125, -11.5, 12 | 9 | 9 / 8 in 4 of 5 | 1.50 | yes |"),
      std::string::npos)
      << text;
  Proof renamed = Cart();
  renamed.name = "cart";
  const std::string again = Written({renamed}, ReadBack(text));
  EXPECT_NE(again.find("| cart | cart-v1 | a | 100 x 8 | 9, 10, 8.125, -11.5, 12 | 9 |"), std::string::npos) << again;
  EXPECT_TRUE(again.ends_with("\n\nBy hand.\n")) << again;
  EXPECT_EQ(Written({Cart()}, ReadBack(text)), text);
}

TEST(ProofsPage, ARowWhoseSettingsHaveChangedIsNotMeasuredYet) {
  const std::string text = Written({Cart()}, {{{proofs::RunOf(Cart()), {{9, 9, 9, 9, 9}, 1.5}}}, ""});
  const auto changed = [](auto change) {
    Proof proof = Cart();
    change(proof);
    return proof;
  };
  for (const Proof& other :
       {changed([](Proof& p) { p.world = "cart-v2"; }), changed([](Proof& p) { p.algorithm = "b"; }),
        changed([](Proof& p) { p.steps = 101; }), changed([](Proof& p) { p.envs = 4; }),
        changed([](Proof& p) { p.over_tcp = true; }), changed([](Proof& p) { p.preset = "sb2"; }),
        changed([](Proof& p) { p.settings[0].second = "0.99"; }), changed([](Proof& p) { p.success = true; })}) {
    const std::string page = Written({other}, ReadBack(text));
    EXPECT_EQ(page.find("| cart by a"), std::string::npos) << page;
    EXPECT_TRUE(page.ends_with("\nNot measured yet: `cart by a`.\n")) << page;
  }
}

TEST(ProofsPage, WhatARowNeedsIsJudgedAnew) {
  Proof proof = Cart();
  const Page page{{{proofs::RunOf(proof), {{9, 9, 9, 9, 7}, 1.5}}}, ""};
  EXPECT_NE(Written({proof}, page).find("| yes |"), std::string::npos);
  proof.seeds = 5;
  EXPECT_NE(Written({proof}, ReadBack(Written({Cart()}, page))).find("8 in 5 of 5 | 1.50 | **no** |"),
            std::string::npos);
  proof.seeds = 4, proof.median_at_least = 9.5;
  EXPECT_NE(Written({proof}, page).find("| **no** |"), std::string::npos);
  EXPECT_FALSE(proofs::Holds(Cart(), {{9, 9, 9, 9, std::numeric_limits<double>::quiet_NaN()}}));
}

}  // namespace
}  // namespace consac
