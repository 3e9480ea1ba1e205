#pragma once
#include "Shim/Slate.h"

#define SNew(type) Shim::WidgetMaker<type>{} <<= typename Shim::Named<type>::FArguments()
#define SAssignNew(into, type)                                                              \
  Shim::WidgetMaker<type>{[&](const TSharedRef<type>& shim_made) { into = shim_made; }} <<= \
      typename Shim::Named<type>::FArguments()
#define SLATE_BEGIN_ARGS(type)         \
 public:                               \
  struct FArguments {                  \
    using WidgetArgsType = FArguments; \
    FArguments()
#define SLATE_END_ARGS() \
  }                      \
  ;

namespace Shim {
template <class W>
struct Named {
  using FArguments = typename W::FArguments;
};
}  // namespace Shim
