// Copyright CONSAC authors. MIT License.
#include "ConsacBlueprintLibrary.h"
#include "ConsacModel.h"
#include "ConsacSocket.h"
#include "ConsacTypes.h"
#include "Misc/AutomationTest.h"
#include "UObject/UObjectGlobals.h"

#if WITH_DEV_AUTOMATION_TESTS

IMPLEMENT_SIMPLE_AUTOMATION_TEST(FConsacMessageTest, "Consac.Messages",
	EAutomationTestFlags::EditorContext | EAutomationTestFlags::ClientContext | EAutomationTestFlags::EngineFilter)
bool FConsacMessageTest::RunTest(const FString&)
{
	// Every failure below is one that the log tells; one that is not announced fails the test.
	UConsacBlueprintLibrary::ForgetErrors(); // those of the last run, a moment ago
	const FConsacSpace Seen = UConsacBlueprintLibrary::MakeBoxSpace(2, 0.0f, 40.0f);
	const FConsacSpace Done = UConsacBlueprintLibrary::MakeDiscreteSpace(3);
	EConsacResult Result = EConsacResult::Failed;
	FString Message;
	FString Error;
	UConsacBlueprintLibrary::CompileTrainingData(Done, Seen, 20000, FString(), Result, Message, Error);
	TestEqual(TEXT("the first message"), Message, FString(TEXT("D#3#0#B#2#0,0,40,40#20000")));
	TArray<float> Observation;
	Observation.Add(3.0f);
	Observation.Add(17.0f);
	UConsacBlueprintLibrary::CompileEnvironmentMessage(Seen, Observation, 1.0f, false, Result, Message, Error);
	TestEqual(TEXT("an observation"), Message, FString(TEXT("3,17#1#0")));
	Observation.Add(1.0f);
	AddExpectedError(TEXT("3 numbers"), EAutomationExpectedErrorFlags::Contains, 1);
	UConsacBlueprintLibrary::CompileEnvironmentMessage(Seen, Observation, 1.0f, false, Result, Message, Error);
	TestTrue(TEXT("too many numbers are refused"), Result == EConsacResult::Failed && !Error.IsEmpty());
	FConsacAction Action;
	UConsacBlueprintLibrary::DecodeAction(Done, TEXT("2"), Result, Action, Error);
	TestEqual(TEXT("an action"), Action.Choice, 2);
	AddExpectedError(TEXT("action"), EAutomationExpectedErrorFlags::Contains, 1);
	UConsacBlueprintLibrary::DecodeAction(Done, TEXT("7"), Result, Action, Error);
	TestTrue(TEXT("no choice of the space"), Result == EConsacResult::Failed);
	return true;
}

IMPLEMENT_SIMPLE_AUTOMATION_TEST(FConsacSocketTest, "Consac.Socket",
	EAutomationTestFlags::EditorContext | EAutomationTestFlags::ClientContext | EAutomationTestFlags::EngineFilter)
bool FConsacSocketTest::RunTest(const FString&)
{
	UConsacBlueprintLibrary::ForgetErrors();
	UConsacSocket* Socket = UConsacBlueprintLibrary::CreateConsacSocket(nullptr, TEXT("127.0.0.1"), 0);
	EConsacResult Result = EConsacResult::Failed;
	FString Text;
	FString Error;
	AddExpectedError(TEXT("nobody is connected"), EAutomationExpectedErrorFlags::Contains, 1);
	Socket->SendData(TEXT("1"), Result, Error);
	TestTrue(TEXT("nobody to send to"), Result == EConsacResult::Failed);
	Socket->OpenSocket(Result, Error);
	TestTrue(TEXT("opens"), Result == EConsacResult::Success && Socket->IsOpen() && Socket->GetOpenPort() > 0);
	AddExpectedError(TEXT("the socket is open already"), EAutomationExpectedErrorFlags::Contains, 1);
	Socket->OpenSocket(Result, Error);
	TestTrue(TEXT("an open socket is not opened"), Result == EConsacResult::Failed);
	AddExpectedError(TEXT("nobody waits to be accepted"), EAutomationExpectedErrorFlags::Contains, 1);
	Socket->AcceptConnection(Result, Text, Error);
	TestTrue(TEXT("nobody to accept"), Result == EConsacResult::Failed);
	Socket->CloseSocket();
	Socket->CloseSocket();
	TestFalse(TEXT("closes"), Socket->IsOpen());
	return true;
}

IMPLEMENT_SIMPLE_AUTOMATION_TEST(FConsacModelTest, "Consac.Model",
	EAutomationTestFlags::EditorContext | EAutomationTestFlags::ClientContext | EAutomationTestFlags::EngineFilter)
bool FConsacModelTest::RunTest(const FString&)
{
	UConsacBlueprintLibrary::ForgetErrors();
	EConsacResult Result = EConsacResult::Success;
	UConsacModel* Model = nullptr;
	FString Error;
	AddExpectedError(TEXT("no such file.consac"), EAutomationExpectedErrorFlags::Contains, 1);
	UConsacBlueprintLibrary::LoadConsacModel(nullptr, TEXT("no such file.consac"), Result, Model, Error);
	TestTrue(TEXT("no file, no model"), Result == EConsacResult::Failed && Model == nullptr && !Error.IsEmpty());
	FConsacAction Action;
	AddExpectedError(TEXT("there is no model yet"), EAutomationExpectedErrorFlags::Contains, 1);
	NewObject<UConsacModel>()->Predict(TArray<float>(), true, Result, Action, Error);
	TestTrue(TEXT("no model, no action"), Result == EConsacResult::Failed);
	return true;
}

#endif
