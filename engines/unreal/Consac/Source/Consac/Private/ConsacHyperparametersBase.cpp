// Copyright CONSAC authors. MIT License.
#include "ConsacHyperparametersBase.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"

FString UConsacHyperparameters::GetAlgorithm() const
{
	return FString();
}

void UConsacHyperparameters::Collect(TArray<FConsacHyperparameter>& Into) const
{
	Into.Reset();
}

void UConsacHyperparameters::AddText(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, const FString& Value)
{
	FConsacHyperparameter Row;
	Row.Name = FString(Name);
	Row.Value = Value;
	Into.Add(Row);
}

void UConsacHyperparameters::AddReal(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, double Value)
{
	AddText(Into, Name, ConsacPlugin::FromUtf8(consac::NumberText(Value)));
}

void UConsacHyperparameters::AddInteger(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, int64 Value)
{
	AddText(Into, Name, ConsacPlugin::FromUtf8(std::to_string(Value)));
}

void UConsacHyperparameters::AddBoolean(TArray<FConsacHyperparameter>& Into, const TCHAR* Name, bool bValue)
{
	AddText(Into, Name, bValue ? TEXT("true") : TEXT("false"));
}
