// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "Templates/PimplPtr.h"
#include "UObject/Object.h"
#include "ConsacSocket.generated.h"

struct FConsacSocketState;

/** A port of this computer and the one trainer that is connected to it, for who sends the messages by hand. No node
 *  waits, and every node may be called at any time. */
UCLASS(BlueprintType)
class CONSAC_API UConsacSocket : public UObject
{
	GENERATED_BODY()

public:
	UConsacSocket();

	/** Opens the port. Fails when it is open already, or another program has it. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Open Socket", ExpandEnumAsExecs="Result"))
	void OpenSocket(EConsacResult& Result, FString& Error);

	/** Closes connection and port. Closing a closed socket does nothing. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Close Socket"))
	void CloseSocket();

	/** Yes when a trainer waits to be accepted, or is connected. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Check Connection", ExpandEnumAsExecs="Answer"))
	void CheckConnection(EConsacAnswer& Answer, FString& Error);

	/** Takes the trainer who waits. Fails when nobody does, or one is connected already. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Accept Connection", ExpandEnumAsExecs="Result"))
	void AcceptConnection(EConsacResult& Result, FString& PeerAddress, FString& Error);

	/** Yes when a whole message has come. Sends on what the trainer had not taken yet. Fails once the trainer has left, or takes
	 *  nothing for 10 s: the connection is closed then. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Check Pending Data", ExpandEnumAsExecs="Answer"))
	void CheckPendingData(EConsacAnswer& Answer, FString& Error);

	/** Takes the message that has come. Fails when there is none, and once the trainer has left: the connection is closed then. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Accept Pending Data", ExpandEnumAsExecs="Result"))
	void AcceptPendingData(EConsacResult& Result, FString& Message, FString& Error);

	/** Sends a message; what the trainer does not take at once goes with the next Check Pending Data. Fails when nobody is
	 *  connected, 1 MiB waits already, or the trainer has left: the connection is closed then. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Send Data", ExpandEnumAsExecs="Result"))
	void SendData(const FString& Message, EConsacResult& Result, FString& Error);

	/** Ends the connection; the port stays open for the next trainer. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(DisplayName="Close Connection"))
	void CloseConnection();

	/** Whether the port is open. */
	UFUNCTION(BlueprintPure, Category="Consac|Socket", meta=(DisplayName="Is Open"))
	bool IsOpen() const;

	/** Whether a trainer is connected. */
	UFUNCTION(BlueprintPure, Category="Consac|Socket", meta=(DisplayName="Is Connected"))
	bool IsConnected() const;

	/** The port that is open; 0 when none is. Tells which one it is when any free port was asked for. */
	UFUNCTION(BlueprintPure, Category="Consac|Socket", meta=(DisplayName="Get Open Port"))
	int32 GetOpenPort() const;

	/** What Create Socket was given. */
	void SetAddress(const FString& NewHost, int32 NewPort);

	virtual void BeginDestroy() override;

private:
	TPimplPtr<FConsacSocketState> State;
};
