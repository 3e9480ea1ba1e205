// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Kismet/BlueprintAsyncActionBase.h"
#include "UObject/Object.h"
#include "UObject/ObjectPtr.h"
#include "UObject/WeakObjectPtrTemplates.h"
#include "ConsacWaitMessageAction.generated.h"

class UConsacSocket;
class UConsacSubsystem;

DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FConsacMessageEvent, const FString&, Message, const FString&, Error);

/** Wait And Accept Message. In a Blueprint function, where such nodes cannot stand, use Check Pending Data and Accept
 *  Pending Data. */
UCLASS()
class CONSAC_API UConsacWaitMessageAction : public UBlueprintAsyncActionBase
{
	GENERATED_BODY()

public:
	/** A message has come. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Socket")
	FConsacMessageEvent OnMessage;

	/** None came in time. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Socket")
	FConsacMessageEvent OnTimeout;

	/** There is no socket, nobody is connected, the trainer has left, or the level has ended, for whoever is still there then; Error
	 *  says which. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Socket")
	FConsacMessageEvent OnFailed;

	/** Waits, without holding up the game, until a message has come, and takes it. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket",
		meta=(BlueprintInternalUseOnly="true", WorldContext="WorldContextObject", DisplayName="Wait And Accept Message"))
	static UConsacWaitMessageAction* WaitAndAcceptMessage(UObject* WorldContextObject, UConsacSocket* Socket, float TimeoutSeconds = 5.0f);

	virtual void Activate() override;

	/** Looks once more; true when there is nothing left to wait for. Called by the subsystem in every frame. */
	bool Look(float DeltaSeconds);

	/** The world goes. Called by the subsystem. */
	void GiveUp();

private:
	UPROPERTY()
	TObjectPtr<UConsacSocket> Target;

	TWeakObjectPtr<UConsacSubsystem> Subsystem;
	float SecondsLeft = 0.0f;
};
