// Copyright CONSAC authors. MIT License.
#include "ConsacWaitMessageAction.h"

#include "ConsacSocket.h"
#include "ConsacSubsystem.h"
#include "UObject/UObjectGlobals.h"

UConsacWaitMessageAction* UConsacWaitMessageAction::WaitAndAcceptMessage(UObject* WorldContextObject, UConsacSocket* Socket, float TimeoutSeconds)
{
	UConsacWaitMessageAction* Action = NewObject<UConsacWaitMessageAction>();
	Action->Target = Socket;
	Action->SecondsLeft = TimeoutSeconds;
	Action->Subsystem = UConsacSubsystem::Of(WorldContextObject);
	if (WorldContextObject != nullptr)
	{
		Action->RegisterWithGameInstance(WorldContextObject);
	}
	return Action;
}

void UConsacWaitMessageAction::Activate()
{
	Super::Activate();
	UConsacSubsystem* Owner = Subsystem.Get();
	if (Owner == nullptr)
	{
		OnFailed.Broadcast(FString(), TEXT("Wait And Accept Message works in a running game alone"));
		SetReadyToDestroy();
	}
	else if (!Look(0.0f))
	{
		Owner->AddWaiting(this);
	}
}

void UConsacWaitMessageAction::GiveUp()
{
	SetReadyToDestroy();
	OnFailed.Broadcast(FString(), TEXT("the level has ended before a message came"));
}

bool UConsacWaitMessageAction::Look(float DeltaSeconds)
{
	EConsacAnswer Answer = EConsacAnswer::Failed;
	EConsacResult Result = EConsacResult::Failed;
	FString Message;
	FString Error = TEXT("Wait And Accept Message got no socket; connect the one that Create Socket gave");
	if (IsValid(Target.Get()))
	{
		Target->CheckPendingData(Answer, Error);
	}
	SecondsLeft -= DeltaSeconds;
	if (Answer == EConsacAnswer::No && SecondsLeft > 0.0f)
	{
		return false;
	}
	if (Answer == EConsacAnswer::Yes)
	{
		Target->AcceptPendingData(Result, Message, Error);
	}
	SetReadyToDestroy();
	if (Answer == EConsacAnswer::No)
	{
		OnTimeout.Broadcast(Message, TEXT("no message came in time"));
	}
	else if (Result == EConsacResult::Success)
	{
		OnMessage.Broadcast(Message, Error);
	}
	else
	{
		OnFailed.Broadcast(Message, Error);
	}
	return true;
}
