// Copyright CONSAC authors. MIT License.
#include "ConsacSocket.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "Templates/PimplPtr.h"

struct FConsacSocketState
{
	consac::Endpoint Endpoint;
	consac::host::Socket Socket;
};

UConsacSocket::UConsacSocket()
	: State(MakePimpl<FConsacSocketState>())
{
}

void UConsacSocket::SetAddress(const FString& NewHost, int32 NewPort)
{
	State->Endpoint.host = ConsacPlugin::ToUtf8(NewHost);
	State->Endpoint.port = NewPort;
}

void UConsacSocket::OpenSocket(EConsacResult& Result, FString& Error)
{
	ConsacPlugin::Answer(State->Socket.Open(State->Endpoint), Result, Error);
}

void UConsacSocket::CloseSocket()
{
	State->Socket.Close();
}

static EConsacAnswer ConsacAnswerOf(const consac::Result<bool>& There, FString& Error)
{
	if (!ConsacPlugin::Explain(There.status(), Error))
	{
		return EConsacAnswer::Failed;
	}
	return *There ? EConsacAnswer::Yes : EConsacAnswer::No;
}

void UConsacSocket::CheckConnection(EConsacAnswer& Answer, FString& Error)
{
	Answer = ConsacAnswerOf(State->Socket.CheckConnection(), Error);
}

void UConsacSocket::AcceptConnection(EConsacResult& Result, FString& PeerAddress, FString& Error)
{
	ConsacPlugin::Answer(State->Socket.AcceptConnection(), Result, Error);
	PeerAddress = ConsacPlugin::FromUtf8(State->Socket.peer());
}

void UConsacSocket::CheckPendingData(EConsacAnswer& Answer, FString& Error)
{
	Answer = ConsacAnswerOf(State->Socket.CheckPendingData(), Error);
}

void UConsacSocket::AcceptPendingData(EConsacResult& Result, FString& Message, FString& Error)
{
	const consac::Result<std::string> Received = State->Socket.AcceptPendingData();
	Message = Received.ok() ? ConsacPlugin::FromUtf8(*Received) : FString();
	ConsacPlugin::Answer(Received.status(), Result, Error);
}

void UConsacSocket::SendData(const FString& Message, EConsacResult& Result, FString& Error)
{
	ConsacPlugin::Answer(State->Socket.SendData(ConsacPlugin::ToUtf8(Message)), Result, Error);
}

void UConsacSocket::CloseConnection()
{
	State->Socket.CloseConnection();
}

bool UConsacSocket::IsOpen() const
{
	return State->Socket.open();
}

bool UConsacSocket::IsConnected() const
{
	return State->Socket.connected();
}

int32 UConsacSocket::GetOpenPort() const
{
	return State->Socket.port();
}

void UConsacSocket::BeginDestroy()
{
	if (State.IsValid()) // a temporary object of Hot Reload has none
	{
		State->Socket.Close();
	}
	Super::BeginDestroy();
}
