#pragma once
// From a C++ member function to a method that scripts call: Bind<World, &World::Join>("join", {"behaviour"}, "Takes a
// place.") is one row of a class's table. Arguments and results are std::int64_t, double, bool, std::string, Floats,
// Doubles, Bytes, Array, Dictionary; a result may also be void, a Status (the script gets its sentence, "" for success)
// or a Result of these (the script gets an empty value, or -1, where it failed). A failure is kept as the object's last
// error and written into the engine's log.

#include <array>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "binding/values.h"
#include "consac/base/status.h"

namespace consac::godot {

/// What every class that scripts see has.
class Instance {
 public:
  virtual ~Instance() = default;
  /// The sentence of the latest call that can fail; "" where it went well.
  std::string LastError() const { return last_error_; }
  /// Keeps a failure and writes it into the engine's log; `where` is "ConsacWorld.serve".
  void Report(const std::string& where, const Status& status);
  /// A call went well: what failed before is over.
  void Forget() { last_error_.clear(); }

 private:
  std::string last_error_;
};

/// One method of a class, as the engine wants to know it.
struct Method {
  std::string name;                         ///< as scripts write it
  std::string help;                         ///< what the editor's help says of it
  std::vector<std::string> argument_names;  ///< as many as argument_types
  std::vector<GDExtensionVariantType> argument_types;
  GDExtensionVariantType result = GDEXTENSION_VARIANT_TYPE_NIL;  ///< NIL: none
  std::string where;                                ///< "ConsacWorld.serve"; set when its class is registered
  GDExtensionClassMethodCall call = nullptr;        ///< with Variants
  GDExtensionClassMethodPtrCall ptrcall = nullptr;  ///< with bare values
};

/// How T crosses the border: the engine's type, and the value that the engine holds in and out.
template <class T>
struct Crossing {
  static constexpr GDExtensionVariantType kType = T::kType;
  using Raw = T;
  static T In(const void* raw) { return T(raw); }
};
template <class T, class R, GDExtensionVariantType type>
struct PlainCrossing {
  static constexpr GDExtensionVariantType kType = type;
  using Raw = R;
  static T In(const void* raw) { return static_cast<T>(*static_cast<const R*>(raw)); }
};
template <>
struct Crossing<std::int64_t> : PlainCrossing<std::int64_t, std::int64_t, GDEXTENSION_VARIANT_TYPE_INT> {};
template <>
struct Crossing<double> : PlainCrossing<double, double, GDEXTENSION_VARIANT_TYPE_FLOAT> {};
template <>
struct Crossing<bool> : PlainCrossing<bool, GDExtensionBool, GDEXTENSION_VARIANT_TYPE_BOOL> {};
template <>
struct Crossing<std::string> {
  static constexpr GDExtensionVariantType kType = GDEXTENSION_VARIANT_TYPE_STRING;
  using Raw = String;
  static std::string In(const void* raw) { return String(raw).utf8(); }
};

/// The value that a script gets of a member function's result, failures reported.
template <class T>
struct Outcome {
  using Type = T;
  static T Of(Instance&, const Method&, T value) { return value; }
};
template <>
struct Outcome<void> {
  using Type = void;
};
template <>
struct Outcome<Status> {
  using Type = std::string;
  static std::string Of(Instance& instance, const Method& method, const Status& status) {
    if (status.ok()) {
      instance.Forget();
    } else {
      instance.Report(method.where, status);
    }
    return status.message();
  }
};
template <class T>
struct Outcome<Result<T>> {
  using Type = T;
  static T Of(Instance& instance, const Method& method, Result<T> result) {
    if (result.ok()) {
      instance.Forget();
      return *std::move(result);
    }
    instance.Report(method.where, result.status());
    if constexpr (std::is_same_v<T, std::int64_t>) return -1;  // where numbers count from 0
    return T{};
  }
};

/// Room for a bare value of any type here, made from a Variant.
class Bare {
 public:
  Bare(GDExtensionVariantType type, const void* variant) : type_(type) {
    FunctionsOf(type).from_variant(storage_.data(), const_cast<void*>(variant));
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;
  ~Bare() {
    if (FunctionsOf(type_).destroy != nullptr) FunctionsOf(type_).destroy(storage_.data());
  }
  /// The value.
  const void* ptr() const { return storage_.data(); }

 private:
  GDExtensionVariantType type_;
  alignas(8) std::array<std::byte, 16> storage_;
};

/// False, with what is wrong in `error`, unless number and types of the arguments fit.
bool CheckArguments(const Method& method, const void* instance, const GDExtensionConstVariantPtr* arguments,
                    GDExtensionInt count, GDExtensionCallError* error);

/// The two ways in which the engine calls a member function.
template <auto member, class T, class R, class... A>
struct Calls {
  using Out = Outcome<std::remove_cvref_t<R>>;
  using Indices = std::index_sequence_for<A...>;

  template <std::size_t... I>
  static R Invoke(void* instance, const GDExtensionConstTypePtr* arguments, std::index_sequence<I...>) {
    return (static_cast<T*>(static_cast<Instance*>(instance))->*member)(
        Crossing<std::remove_cvref_t<A>>::In(arguments[I])...);
  }
  // What the script gets, as the engine holds it.
  static auto RawResult(void* method, void* instance, const GDExtensionConstTypePtr* arguments) {
    using Raw = typename Crossing<typename Out::Type>::Raw;
    return Raw(Out::Of(*static_cast<Instance*>(instance), *static_cast<const Method*>(method),
                       Invoke(instance, arguments, Indices())));
  }
  static void Ptrcall(void* method, GDExtensionClassInstancePtr instance, const GDExtensionConstTypePtr* arguments,
                      GDExtensionTypePtr result) {
    if constexpr (std::is_void_v<R>) {
      Invoke(instance, arguments, Indices());
    } else {
      auto raw = RawResult(method, instance, arguments);
      if constexpr (std::is_arithmetic_v<decltype(raw)>) {
        *static_cast<decltype(raw)*>(result) = raw;
      } else {
        raw.MoveTo(result);
      }
    }
  }
  template <std::size_t... I>
  static void CallChecked(void* method, void* instance, const GDExtensionConstVariantPtr* variants, void* result,
                          std::index_sequence<I...>) {
    [[maybe_unused]] const std::array<Bare, sizeof...(I)> bare{
        Bare(Crossing<std::remove_cvref_t<A>>::kType, variants[I])...};
    const std::array<GDExtensionConstTypePtr, sizeof...(I) + 1> arguments{bare[I].ptr()..., nullptr};
    if constexpr (std::is_void_v<R>) {
      Invoke(instance, arguments.data(), Indices());
    } else {
      auto raw = RawResult(method, instance, arguments.data());
      engine.variant_destroy(result);
      FunctionsOf(Crossing<typename Out::Type>::kType).to_variant(result, &raw);
    }
  }
  static void Call(void* method, GDExtensionClassInstancePtr instance, const GDExtensionConstVariantPtr* variants,
                   GDExtensionInt count, GDExtensionVariantPtr result, GDExtensionCallError* error) {
    if (!CheckArguments(*static_cast<const Method*>(method), instance, variants, count, error)) return;
    CallChecked(method, instance, variants, result, Indices());
  }
};

template <auto member, class T, class R, class... A>
Method MakeMethod(std::string name, std::vector<std::string> argument_names) {
  using All = Calls<member, T, R, A...>;
  Method method;
  method.name = std::move(name);
  method.argument_names = std::move(argument_names);
  method.argument_types = {Crossing<std::remove_cvref_t<A>>::kType...};
  if constexpr (!std::is_void_v<R>) method.result = Crossing<typename All::Out::Type>::kType;
  method.call = &All::Call;
  method.ptrcall = &All::Ptrcall;
  return method;
}
template <auto member, class T, class C, class R, class... A>
Method MakeMethodOf(R (C::*)(A...), std::string name, std::vector<std::string> names) {
  return MakeMethod<member, T, R, A...>(std::move(name), std::move(names));
}
template <auto member, class T, class C, class R, class... A>
Method MakeMethodOf(R (C::*)(A...) const, std::string name, std::vector<std::string> names) {
  return MakeMethod<member, T, R, A...>(std::move(name), std::move(names));
}

/// The row of class T's table for a member function of it or of what it stems from; `help` in the editor's BBCode.
template <class T, auto member>
Method Bind(std::string name, std::vector<std::string> argument_names, std::string help) {
  Method method = MakeMethodOf<member, T>(member, std::move(name), std::move(argument_names));
  method.help = std::move(help);
  return method;
}

}  // namespace consac::godot
