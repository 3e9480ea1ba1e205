#pragma once
// For the worlds' tests: puts a world into a state, by the names that its Visit lists.

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "consac/base/archive.h"

namespace consac::worlds {

/// Sets the field `name` of `world`; its length and type stay.
template <class W, class T>
void Put(W& world, const std::string& name, const std::vector<T>& values) {
  StateWriter writer;
  world.Visit(writer);
  ASSERT_TRUE(writer.fields().contains(name)) << name;
  std::vector<std::byte>& bytes = writer.fields().at(name).bytes;
  ASSERT_EQ(bytes.size(), values.size() * sizeof(T)) << name;
  std::memcpy(bytes.data(), values.data(), bytes.size());
  StateReader reader(writer.fields());
  world.Visit(reader);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
}

}  // namespace consac::worlds
