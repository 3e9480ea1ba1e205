#pragma once
// Delegates: lists of calls that may change while they are called, as Unreal's.

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "Shim/Macros.h"

class UObject;

namespace Shim {
/// Becomes null when the object goes.
std::shared_ptr<UObject*> TokenOf(const UObject* object);
}  // namespace Shim

class FDelegateHandle {
 public:
  FDelegateHandle() = default;
  explicit FDelegateHandle(int shim_number) : shim_number_(shim_number) {}
  friend bool operator==(const FDelegateHandle&, const FDelegateHandle&) = default;

 private:
  int shim_number_ = 0;
};

template <class Signature>
class TMulticastDelegate;

/// Calls bound to objects; an object that is gone is passed over.
template <class... P>
class TMulticastDelegate<void(P...)> {
 public:
  template <class C, class O>
  FDelegateHandle AddUObject(O* object, void (C::*function)(P...)) {
    return ShimBind(object, [object, function](P... values) { (object->*function)(values...); });
  }
  /// Of any object, which must have been removed before it goes.
  template <class C, class O>
  FDelegateHandle AddRaw(O* object, void (C::*function)(P...)) {
    return ShimBind(nullptr, [object, function](P... values) { (object->*function)(values...); });
  }
  /// One function of one object only once: more is an error in the engine.
  template <class C, class O>
  void ShimAddDynamic(O* object, void (C::*function)(P...)) {
    const std::string name(reinterpret_cast<const char*>(&function), sizeof(function));
    for (const Call& call : *calls_) check(call.token != Shim::TokenOf(object) || call.function != name);
    ShimBind(
        object, [object, function](P... values) { (object->*function)(values...); }, name);
  }
  void Remove(FDelegateHandle handle) {
    auto calls = std::make_shared<std::vector<Call>>(*calls_);
    std::erase_if(*calls, [&](const Call& call) { return call.handle == handle; });
    calls_ = std::move(calls);
  }
  bool IsBound() const { return !calls_->empty(); }
  void Broadcast(P... values) const {
    const std::shared_ptr<const std::vector<Call>> calls = calls_;
    for (const Call& call : *calls) {
      if (call.token == nullptr || *call.token != nullptr) call.call(values...);
    }
  }
  /// For tests and the shim: any function, for as long as `object` lives (null: for ever).
  FDelegateHandle ShimBind(const UObject* object, std::function<void(P...)> call, std::string function = {}) {
    auto calls = std::make_shared<std::vector<Call>>(*calls_);
    calls->push_back({FDelegateHandle(++count_), object != nullptr ? Shim::TokenOf(object) : nullptr, std::move(call),
                      std::move(function)});
    calls_ = calls;
    return calls->back().handle;
  }

 private:
  struct Call {
    FDelegateHandle handle;
    std::shared_ptr<UObject*> token;
    std::function<void(P...)> call;
    std::string function;  // of a dynamic binding
  };
  // A list that is being gone through stays as it is.
  std::shared_ptr<const std::vector<Call>> calls_ = std::make_shared<std::vector<Call>>();
  int count_ = 0;
};

/// A function of one object without arguments.
class FSimpleDelegate {
 public:
  template <class O>
  static FSimpleDelegate CreateRaw(O* object, void (O::*function)()) {
    FSimpleDelegate made;
    made.shim_object_ = object;
    made.shim_call_ = [object, function] { (object->*function)(); };
    return made;
  }
  const void* shim_object_ = nullptr;
  std::function<void()> shim_call_;
};
struct FSimpleMulticastDelegate {
  using FDelegate = FSimpleDelegate;
};

#define AddDynamic(object, function) ShimAddDynamic(object, function)
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE(name) \
  class name : public TMulticastDelegate<void()> {}
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE_OneParam(name, T1, n1) \
  class name : public TMulticastDelegate<void(T1)> {}
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(name, T1, n1, T2, n2) \
  class name : public TMulticastDelegate<void(T1, T2)> {}
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE_ThreeParams(name, T1, n1, T2, n2, T3, n3) \
  class name : public TMulticastDelegate<void(T1, T2, T3)> {}
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE_FourParams(name, T1, n1, T2, n2, T3, n3, T4, n4) \
  class name : public TMulticastDelegate<void(T1, T2, T3, T4)> {}
#define DECLARE_DYNAMIC_DELEGATE(name) \
  class name {}
#define DECLARE_DYNAMIC_DELEGATE_OneParam(name, T1, n1) \
  class name {}
#define DECLARE_DYNAMIC_DELEGATE_TwoParams(name, T1, n1, T2, n2) \
  class name {}
#define DECLARE_DYNAMIC_DELEGATE_ThreeParams(name, T1, n1, T2, n2, T3, n3) \
  class name {}
