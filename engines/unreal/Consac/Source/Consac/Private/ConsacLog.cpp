// Copyright CONSAC authors. MIT License.
#include "ConsacLog.h"

#include <map>
#include <mutex>
#include <string>

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"

DEFINE_LOG_CATEGORY(LogConsac);

namespace ConsacPlugin
{

constexpr double QuietSeconds = 1.0;
constexpr std::size_t MostKept = 256; // texts

// When each text came last.
struct FTextsSaid
{
	std::mutex Mutex;
	std::map<std::string, double> Came;
};

static FTextsSaid& TextsSaid()
{
	static FTextsSaid Said;
	return Said;
}

static bool IsNew(const FString& Text)
{
	FTextsSaid& Said = TextsSaid();
	const double Now = consac::Now();
	const std::lock_guard<std::mutex> Lock(Said.Mutex);
	if (Said.Came.size() >= MostKept)
	{
		std::erase_if(Said.Came, [Now](const auto& Row) { return Now - Row.second >= QuietSeconds; });
	}
	const auto [Row, bFirst] = Said.Came.try_emplace(ToUtf8(Text), Now);
	const bool bNew = bFirst || Now - Row->second >= QuietSeconds;
	Row->second = Now;
	return bNew;
}

void ForgetErrors()
{
	FTextsSaid& Said = TextsSaid();
	const std::lock_guard<std::mutex> Lock(Said.Mutex);
	Said.Came.clear();
}

void LogError(const FString& Text)
{
	if (IsNew(Text))
	{
		UE_LOG(LogConsac, Error, TEXT("%s"), *Text);
	}
}

}
