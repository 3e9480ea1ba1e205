#pragma once
// Macros that every file of a plugin sees.

#include <cstdint>
#include <cstdlib>

using int8 = std::int8_t;
using int16 = std::int16_t;
using int32 = std::int32_t;
using int64 = long long;
using uint8 = std::uint8_t;
using uint16 = std::uint16_t;
using uint32 = std::uint32_t;
using uint64 = unsigned long long;
using TCHAR = char16_t;

#define TEXT(x) u##x
#define PI (3.1415926535897932f)
#define check(expr) ((expr) ? (void)0 : std::abort())
#define checkf(expr, ...) check(expr)
#define verify(expr) check(expr)
#define verifyf(expr, ...) check(expr)
#define ensure(expr) (!!(expr))
#define ensureMsgf(expr, ...) (!!(expr))
#define THIRD_PARTY_INCLUDES_START
#define THIRD_PARTY_INCLUDES_END
#if defined(_WIN32)
#define PLATFORM_WINDOWS 1
#else
#define PLATFORM_WINDOWS 0
#endif
#if defined(__linux__)
#define PLATFORM_LINUX 1
#else
#define PLATFORM_LINUX 0
#endif
#define UE_BUILD_SHIPPING 0
#define WITH_EDITOR 1
#define WITH_EDITORONLY_DATA 1

/// Of something that a later version of the engine warns about.
#define SHIM_DEPRECATED(why) [[deprecated(why)]]

#define UCLASS(...)
#define USTRUCT(...)
#define UENUM(...)
#define UINTERFACE(...)
#define UDELEGATE(...)
#define UFUNCTION(...)
#define UPROPERTY(...)
#define UPARAM(...)
#define UMETA(...)
#define SHIM_JOIN_(a, b, c, d) a##b##c##d
#define SHIM_JOIN(a, b, c, d) SHIM_JOIN_(a, b, c, d)
#define GENERATED_BODY() SHIM_JOIN(CURRENT_FILE_ID, _, __LINE__, _GENERATED_BODY)

#define CONSAC_API
#define CONSACEDITOR_API
#define CONSACSAMPLES_API
