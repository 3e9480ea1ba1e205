// The container: whole or refused, wherever it is cut or changed.
#include "consac/model/model_file.h"

#include <gtest/gtest.h>

#include <cstring>

namespace consac {
namespace {

ModelFile Small() {
  ModelFile file;
  file.spec_json = R"({"kind":"test"})";
  const float values[] = {1, 2, 3, 4, 5, 6};
  file.tensors["pi/0/w"] = Tensor::OfFloats(values, {2, 3});
  file.tensors["empty"] = Tensor{DType::kF32, {0}, {}};
  return file;
}

/// A file with this header text and data.
std::vector<std::byte> WithHeader(const std::string& header, std::size_t data_bytes) {
  std::vector<std::byte> bytes(8 + header.size() + data_bytes);
  const std::uint64_t length = header.size();
  std::memcpy(bytes.data(), &length, 8);
  std::memcpy(bytes.data() + 8, header.data(), header.size());
  return bytes;
}

TEST(ModelFile, ReadsBackWhatItWrote) {
  const auto parsed = ModelFile::Parse(Small().Serialise());
  ASSERT_TRUE(parsed.ok()) << parsed.status().message();
  EXPECT_EQ(parsed->spec_json, Small().spec_json);
  ASSERT_EQ(parsed->tensors.size(), 2u);
  const Tensor& tensor = parsed->tensors.find("pi/0/w")->second;
  EXPECT_EQ(tensor.shape, (std::vector<std::int64_t>{2, 3}));
  EXPECT_EQ(tensor.floats()[5], 6.0f);
}

TEST(ModelFile, CutAnywhereIsRefused) {
  const std::vector<std::byte> bytes = Small().Serialise();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_EQ(ModelFile::Parse(std::span(bytes).first(length)).status().code(), StatusCode::kDataLoss) << length;
  }
}

// A flipped bit may hit padding or spelling that means the same; then the content is the same.
TEST(ModelFile, AFlippedBitNeverChangesTheContent) {
  const std::vector<std::byte> bytes = Small().Serialise();
  int refused = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const int bit : {0, 3, 7}) {
      std::vector<std::byte> damaged = bytes;
      damaged[i] ^= std::byte{1} << bit;
      const auto parsed = ModelFile::Parse(damaged);
      if (!parsed.ok()) {
        ++refused;
        continue;
      }
      EXPECT_EQ(parsed->Serialise(), bytes) << i;
    }
  }
  EXPECT_GT(refused, static_cast<int>(bytes.size()) * 2);
}

TEST(ModelFile, ForeignAndNewerFilesAreNamed) {
  const auto foreign = ModelFile::Parse(WithHeader(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", 4));
  EXPECT_NE(foreign.status().message().find("without CONSAC's metadata"), std::string::npos);
  const auto newer = ModelFile::Parse(
      WithHeader(R"({"__metadata__":{"format":"consac","consac.version":"99","consac.spec":"{}"}})", 0));
  EXPECT_NE(newer.status().message().find("version 99"), std::string::npos);
  const auto other = ModelFile::Parse(WithHeader(R"({"__metadata__":{"format":"pt"}})", 0));
  EXPECT_NE(other.status().message().find("'pt'"), std::string::npos);
}

TEST(ModelFile, HostileHeadersAreRefused) {
  const std::string head =
      R"({"__metadata__":{"format":"consac","consac.version":"1","consac.spec":"{}","consac.sha256":""},)";
  for (
      const std::string& tail : {
          std::string(R"("a":{"dtype":"F32","shape":[2],"data_offsets":[0,4]}})"),  // size and shape differ
          std::string(R"("a":{"dtype":"F32","shape":[4611686018427387904,4],"data_offsets":[0,8]}})"),  // overflow
          std::string(R"("a":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}})"),                      // hole
          std::string(R"("a":{"dtype":"F99","shape":[2],"data_offsets":[0,8]}})"),                      // type
          std::string(
              R"("a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})"),
          "\"a\":" + std::string(5000, '[') + "}",
      }) {
    EXPECT_EQ(ModelFile::Parse(WithHeader(head + tail, 8)).status().code(), StatusCode::kDataLoss)
        << tail.substr(0, 80);
  }
  std::vector<std::byte> huge(16, std::byte{0xff});
  EXPECT_FALSE(ModelFile::Parse(huge).ok());
}

TEST(ModelFile, StateTravelsAsTensors) {
  StateMap state;
  state["learner/m"] = {DType::kF64, std::vector<std::byte>(16, std::byte{3})};
  ModelFile file = Small();
  file.PutState(state);
  const auto parsed = ModelFile::Parse(file.Serialise());
  ASSERT_TRUE(parsed.ok());
  const StateMap back = parsed->TakeState();
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(back.begin()->second.bytes, state["learner/m"].bytes);
}

}  // namespace
}  // namespace consac
