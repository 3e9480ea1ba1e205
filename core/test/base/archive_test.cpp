// One list of state: written, read back, hashed; a state that does not fit is refused by name.
#include "consac/base/archive.h"

#include <gtest/gtest.h>

#include <cstring>

#include "consac/base/rng.h"

namespace consac {
namespace {

struct Inner {
  double value = 0.5;
  void Visit(Archive& archive) { archive("value", value); }
};

struct Outer {
  int number = 3;
  bool flag = true;
  std::string text = "road";
  std::vector<float> list = {1, 2};
  float fixed[3] = {4, 5, 6};
  Inner inner;
  std::vector<Inner> many{2};
  void Visit(Archive& archive) {
    archive("number", number);
    archive("flag", flag);
    archive("text", text);
    archive("list", list);
    archive("fixed", std::span<float>(fixed));
    archive("inner", inner);
    archive("many", many);
  }
};

StateMap Save(Outer& object) {
  StateWriter writer;
  object.Visit(writer);
  EXPECT_TRUE(writer.status().ok());
  return writer.fields();
}

TEST(Archive, ReadsBackWhatItWrote) {
  Outer object;
  object.number = 7;
  object.text = "a longer text";
  object.list = {9, 8, 7};
  object.many[1].value = -2;
  const StateMap state = Save(object);
  EXPECT_TRUE(state.contains("many/1/value"));
  Outer other;
  StateReader reader(state);
  other.Visit(reader);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  EXPECT_EQ(other.number, 7);
  EXPECT_EQ(other.text, "a longer text");
  EXPECT_EQ(other.list, object.list);
  EXPECT_EQ(HashState(object), HashState(other));
}

TEST(Archive, AnyChangeChangesTheHash) {
  Outer a, b;
  EXPECT_EQ(HashState(a), HashState(b));
  b.inner.value = 0.25;
  EXPECT_NE(HashState(a), HashState(b));
}

TEST(Archive, MissingFieldAndOtherLengthAreNamed) {
  Outer object;
  StateMap state = Save(object);
  state.erase("inner/value");
  StateReader missing(state);
  object.Visit(missing);
  EXPECT_EQ(missing.status().code(), StatusCode::kDataLoss);
  EXPECT_NE(missing.status().message().find("'inner/value'"), std::string::npos);

  state = Save(object);
  state["fixed"].bytes.resize(8);
  StateReader shorter(state);
  object.Visit(shorter);
  EXPECT_NE(shorter.status().message().find("'fixed'"), std::string::npos);
}

TEST(Archive, AnImpossibleValueIsNamedWithItsPath) {
  struct Generator {
    Rng rng;
    void Visit(Archive& archive) { archive("rng", rng); }
  } object;
  StateWriter writer;
  object.Visit(writer);
  const std::uint32_t beyond = 7;
  std::memcpy(writer.fields().at("rng/used").bytes.data(), &beyond, sizeof(beyond));
  StateReader reader(writer.fields());
  object.Visit(reader);
  EXPECT_EQ(reader.status().code(), StatusCode::kDataLoss);
  EXPECT_NE(reader.status().message().find("'rng/used'"), std::string::npos) << reader.status().message();
}

TEST(Archive, AFlagThatIsNeitherTrueNorFalseIsRefused) {
  Outer object;
  StateMap state = Save(object);
  state.at("flag").bytes[0] = std::byte{0};
  StateReader cleared(state);
  object.Visit(cleared);
  ASSERT_TRUE(cleared.status().ok());
  EXPECT_FALSE(object.flag);
  state.at("flag").bytes[0] = std::byte{2};
  StateReader reader(state);
  object.Visit(reader);
  EXPECT_EQ(reader.status().code(), StatusCode::kDataLoss);
  EXPECT_NE(reader.status().message().find("'flag'"), std::string::npos) << reader.status().message();
}

TEST(Archive, ANameTwiceIsOurMistakeAndReported) {
  StateWriter writer;
  int number = 1;
  writer("x", number);
  writer("x", number);
  EXPECT_EQ(writer.status().code(), StatusCode::kInternal);
}

}  // namespace
}  // namespace consac
