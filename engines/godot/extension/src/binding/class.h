#pragma once
// Classes that scripts can make: a name and a table of methods each. All of them are reference counted, as the engine's
// RefCounted is.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "binding/method.h"

namespace consac::godot {

/// A number with a name, as scripts see it: ConsacWorld.ACT.
struct Constant {
  std::string group;  ///< the enumeration that it belongs to
  std::string name;   ///< unique within the class
  std::int64_t value = 0;
  std::string help;  ///< what the editor's help says of it
};

/// What a class is made of.
struct ClassTable {
  std::string name;                 ///< as scripts write it
  std::string brief;                ///< what the editor's help says of it first
  std::string help;                 ///< and then
  std::vector<Method> methods;      ///< a row each
  std::vector<Constant> constants;  ///< a row each
  Instance* (*make)() = nullptr;    ///< a new object of ours behind the engine's
};

/// The page of the editor's help, as the XML that the engine reads.
std::string HelpOf(const ClassTable& table);

/// Makes the class known to the engine, and unknown again when it goes: scripts hold no object of it by then.
class RegisteredClass {
 public:
  explicit RegisteredClass(ClassTable table);
  RegisteredClass(const RegisteredClass&) = delete;
  RegisteredClass& operator=(const RegisteredClass&) = delete;
  ~RegisteredClass();

 private:
  ClassTable table_;
  StringName name_;
};

}  // namespace consac::godot
