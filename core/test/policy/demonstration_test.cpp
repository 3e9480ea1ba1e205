// Demonstrations that a learner can have, and those that it cannot. What an engine records is read back in
// engines/host/test/driver_test.cpp.
#include "consac/policy/demonstration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>

namespace consac {
namespace {

template <class T>
Tensor StepsTensor(DType dtype, std::vector<std::int64_t> shape, std::vector<T> values) {
  Tensor tensor{dtype, std::move(shape), std::vector<std::byte>(values.size() * sizeof(T))};
  std::memcpy(tensor.bytes.data(), values.data(), tensor.bytes.size());
  return tensor;
}

/// Three steps: two numbers and a choice are seen, a choice of 5, 6 and 7 is made.
ModelFile Recorded() {
  ModelFile file;
  file.spec_json = R"({"kind":"demonstration","behaviours":[{"name":"walker","observation":{"type":"dict","spaces":[)"
                   R"({"name":"at","space":{"type":"box","shape":[2],"dtype":"F32","low":[-1,-1],"high":[1,1]}},)"
                   R"({"name":"gear","space":{"type":"discrete","n":3,"start":0}}]},)"
                   R"("action":{"type":"discrete","n":3,"start":5}}]})";
  file.tensors["observations/at"] = StepsTensor<float>(DType::kF32, {3, 2}, {0, 0.5f, 1, 1.5f, -1, -7});
  file.tensors["observations/gear"] = StepsTensor<std::int32_t>(DType::kI32, {3}, {0, 1, 2});
  file.tensors["actions"] = StepsTensor<std::int32_t>(DType::kI32, {3}, {5, 7, 6});
  file.tensors["rewards"] = StepsTensor<float>(DType::kF32, {3}, {1, 2, 3});
  file.tensors["terminated"] = StepsTensor<std::uint8_t>(DType::kU8, {3}, {0, 1, 0});
  file.tensors["truncated"] = StepsTensor<std::uint8_t>(DType::kU8, {3}, {0, 0, 1});
  file.tensors["slots"] = StepsTensor<std::int32_t>(DType::kI32, {3}, {0, 0, 4});
  return file;
}

TEST(Demonstration, IsReadAsRows) {
  const Result<Demonstration> read = Demonstration::FromFile(Recorded());
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->steps(), 3);
  EXPECT_EQ(read->behaviour.name, "walker");
  EXPECT_EQ(read->behaviour.slots, 5);
  const Layout& seen = read->behaviour.observation_layout;
  const std::byte* last = read->observations.data() + 2 * seen.row_bytes;
  EXPECT_EQ(ReadElement(seen.leaves[0], last, 1), -7.0) << "beyond its bounds, as it was seen";
  EXPECT_EQ(ReadElement(seen.leaves[1], last, 0), 2.0);
  const Layout& done = read->behaviour.action_layout;
  EXPECT_EQ(ReadElement(done.leaves[0], read->actions.data() + done.row_bytes, 0), 7.0);
  EXPECT_EQ(read->truncated[2], 1);
}

TEST(Demonstration, SaysWhatIsWrongWithIt) {
  const auto fault = [](const std::function<void(ModelFile*)>& spoil) {
    ModelFile file = Recorded();
    spoil(&file);
    const Status status = Demonstration::FromFile(file).status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss);
    return status.message();
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(fault([](ModelFile* file) { file->spec_json = "{}"; }), HasSubstr("not of kind 'demonstration'"));
  EXPECT_THAT(fault([](ModelFile* file) { file->spec_json = R"({"kind":"demonstration","behaviours":[]})"; }),
              HasSubstr("not of one behaviour"));
  EXPECT_THAT(fault([](ModelFile* file) { file->tensors.erase("slots"); }), HasSubstr("lacks the tensor 'slots'"));
  EXPECT_THAT(fault([](ModelFile* file) {
                file->tensors["actions"] = StepsTensor<std::int32_t>(DType::kI32, {2}, {5, 6});
              }),
              HasSubstr("a tensor 'actions' of another type or size"));
  EXPECT_THAT(fault([](ModelFile* file) {
                file->tensors["actions"] = StepsTensor<std::int32_t>(DType::kI32, {3}, {5, 8, 6});
              }),
              HasSubstr("in actions of step 1, 8 where"));
  EXPECT_THAT(fault([](ModelFile* file) {
                file->tensors["rewards"] = StepsTensor<float>(DType::kF32, {3}, {1, INFINITY, 0});
              }),
              HasSubstr("of step 1 that no step can have"));
  EXPECT_THAT(fault([](ModelFile* file) {
                file->tensors["slots"] = StepsTensor<std::int32_t>(DType::kI32, {3}, {0, 0, -1});
              }),
              HasSubstr("of step 2"));
}

}  // namespace
}  // namespace consac
