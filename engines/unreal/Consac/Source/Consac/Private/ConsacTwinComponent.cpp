// Copyright CONSAC authors. MIT License.
#include "ConsacTwinComponent.h"

#include "Components/StaticMeshComponent.h"
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacTwinState.h"
#include "ConsacTwinTable.h"
#include "GameFramework/Actor.h"
#include "Templates/PimplPtr.h"
#include "UObject/UObjectGlobals.h"


namespace ConsacPlugin
{

// Which has that name; -1 none.
static int32 NumberOf(const std::vector<FName>& Names, FName Name)
{
	const auto Found = std::find(Names.begin(), Names.end(), Name);
	return Found == Names.end() ? -1 : static_cast<int32>(Found - Names.begin());
}

// "no joint 'elbow': there are 'a', 'b', 'c' and 4 more".
static std::string NoneOf(const char* What, FName Name, const std::vector<FName>& Names)
{
	constexpr std::size_t Few = 8;
	std::string Text = std::string("no ") + What + " " + consac::Quote(ToUtf8(Name.ToString())) + ": there are";
	for (std::size_t Row = 0; Row < std::min(Few, Names.size()); ++Row)
	{
		Text += (Row == 0 ? " " : ", ") + consac::Quote(ToUtf8(Names[Row].ToString()));
	}
	return Names.size() > Few ? Text + " and " + std::to_string(Names.size() - Few) + " more" : Text;
}

template <class T>
static std::vector<FName> NamesOf(const std::vector<T>& Named)
{
	std::vector<FName> Names;
	for (const T& Row : Named)
	{
		Names.push_back(FName(*FromUtf8(Row.name)));
	}
	return Names;
}

bool TellTwin(const UObject& Of, const consac::Status& Status)
{
	if (!Status.ok())
	{
		LogError(FString::Printf(TEXT("the twin %s: %s"), *Of.GetName(), *FromUtf8(Status.message())));
	}
	return Status.ok();
}

static consac::Status NoTwin()
{
	return consac::Status(consac::StatusCode::kFailedPrecondition, "there is no robot: it does not play, or its Twin or Path is missing or could not be read");
}

}

UConsacTwinComponent::UConsacTwinComponent()
	: State(MakePimpl<FConsacTwinState>())
{
	PrimaryComponentTick.bCanEverTick = true;
	PrimaryComponentTick.TickGroup = TG_PostPhysics;
}

// What moves with a joint; null where somebody destroyed it. Of a joint there are two: one that stands still, and one that moves.
USceneComponent* UConsacTwinComponent::MoverOf(int32 Joint) const
{
	USceneComponent* Mover = Made[2 * Joint + 1].Get();
	return IsValid(Mover) ? Mover : nullptr;
}

USceneComponent* UConsacTwinComponent::Make(USceneComponent* Parent, const FString& Name)
{
	AActor* Owner = GetOwner();
	USceneComponent* New = NewObject<USceneComponent>(Owner, MakeUniqueObjectName(Owner, UConsacTwinComponent::StaticClass(), FName(*Name)));
	New->SetupAttachment(Parent);
	New->RegisterComponent();
	Made.Add(New);
	return New;
}

void UConsacTwinComponent::Build()
{
	UConsacTwin* Source = Twin.Get();
	FString Error;
	if (!IsValid(Source) && Path.IsEmpty())
	{
		return; // a graph may set one; whoever asks it before is told
	}
	if (!IsValid(Source))
	{
		Source = NewObject<UConsacTwin>(this);
		if (!Source->Load(Path, Error)) // which the log has
		{
			return;
		}
	}
	const FConsacTwinTable* Table = Source->GetTable();
	if (Table == nullptr)
	{
		ConsacPlugin::TellTwin(*this, ConsacPlugin::NoTwin());
		return;
	}
	State->Posture.emplace(*Table->Robot);
	const consac::robot::Robot& Robot = State->Posture->robot();
	State->Joints = ConsacPlugin::NamesOf(Robot.joints);
	State->Links = ConsacPlugin::NamesOf(Robot.links);
	State->Bodies.assign(Robot.links.size(), FConsacTwinBody());
	const consac::robot::NodeNames Names = consac::robot::NodeNamesOf(Robot);
	for (std::size_t Joint = 0; Joint < Robot.joints.size(); ++Joint)
	{
		const int32 Parent = Robot.joints[Joint].parent;
		USceneComponent* Frame = Make(Parent == 0 ? this : MoverOf(Parent - 1), ConsacPlugin::FromUtf8(Names.frames[Joint]));
		Frame->SetRelativeTransform(ConsacPlugin::ToTransform(Robot.joints[Joint].rest));
		Make(Frame, ConsacPlugin::FromUtf8(Names.joints[Joint]));
	}
	MoveJoints();
	for (const FConsacTwinMesh& Row : Meshes)
	{
		Hang(Row);
	}
	if (Motion == EConsacTwinMotion::Physics)
	{
		BuildBodies();
	}
}

void UConsacTwinComponent::Hang(const FConsacTwinMesh& Row)
{
	USceneComponent* Link = GetLinkComponent(Row.Link);
	if (Link == nullptr || !IsValid(Row.Mesh.Get()))
	{
		const std::string Name = ConsacPlugin::ToUtf8(Row.Link.ToString());
		ConsacPlugin::TellTwin(*this, consac::Status(consac::StatusCode::kNotFound, Link == nullptr ? "a mesh is for " + ConsacPlugin::NoneOf("link", Row.Link, State->Links)
			: "the mesh of link " + consac::Quote(Name) + " is missing; choose one in Meshes"));
		return;
	}
	UStaticMeshComponent* Shown = NewObject<UStaticMeshComponent>(GetOwner());
	Shown->SetupAttachment(Link);
	Shown->SetStaticMesh(Row.Mesh.Get());
	Shown->SetRelativeTransform(Row.Place);
	Shown->RegisterComponent();
	FConsacTwinBody& Body = State->Bodies[static_cast<std::size_t>(ConsacPlugin::NumberOf(State->Links, Row.Link))];
	if (Body.Component < 0)
	{
		Body.Component = Made.Num();
		Body.Place = ConsacPlugin::FromTransform(Row.Place);
	}
	Made.Add(Shown);
}

// Every joint's component to where its joint is: a roll about X, or a shift along it.
void UConsacTwinComponent::MoveJoints()
{
	const consac::robot::Robot& Robot = State->Posture->robot();
	for (std::size_t Joint = 0; Joint < Robot.joints.size(); ++Joint)
	{
		const int32 Number = static_cast<int32>(Joint);
		USceneComponent* Mover = Robot.joints[Joint].position_index >= 0 ? MoverOf(Number) : nullptr;
		if (Mover != nullptr)
		{
			Mover->SetRelativeTransform(ConsacPlugin::ToTransform(consac::robot::JointMotion(Robot.joints[Joint], State->Posture->At(Number))));
		}
	}
}

bool UConsacTwinComponent::SetJoint(FName Joint, double Position)
{
	consac::Status Status = ConsacPlugin::NoTwin();
	if (State->Posture)
	{
		const int32 Number = ConsacPlugin::NumberOf(State->Joints, Joint);
		Status = Number < 0 ? consac::Status(consac::StatusCode::kNotFound, ConsacPlugin::NoneOf("joint", Joint, State->Joints))
			: State->Asked().Set(Number, ConsacPlugin::FromDegreesOrCentimetres(State->Posture->robot().joints[static_cast<std::size_t>(Number)], Position));
	}
	if (ConsacPlugin::TellTwin(*this, Status))
	{
		State->Wanted ? DriveJoints() : MoveJoints();
	}
	return Status.ok();
}

double UConsacTwinComponent::GetJoint(FName Joint) const
{
	const int32 Number = State->Posture ? ConsacPlugin::NumberOf(State->Joints, Joint) : -1;
	return Number < 0 ? 0.0
		: ConsacPlugin::ToDegreesOrCentimetres(State->Posture->robot().joints[static_cast<std::size_t>(Number)], State->Posture->At(Number));
}

bool UConsacTwinComponent::SetPose(const TArray<double>& Positions)
{
	consac::Status Status = ConsacPlugin::NoTwin();
	if (State->Posture)
	{
		const consac::robot::Robot& Robot = State->Posture->robot();
		std::vector<double> Wanted;
		for (int32 Number = 0; Number < Positions.Num(); ++Number) // one too many is told by Set All
		{
			const bool bKnown = Number < Robot.positions();
			const auto Joint = static_cast<std::size_t>(bKnown ? Robot.position_joints[static_cast<std::size_t>(Number)] : 0);
			Wanted.push_back(bKnown ? ConsacPlugin::FromDegreesOrCentimetres(Robot.joints[Joint], Positions[Number]) : 0.0);
		}
		Status = State->Asked().SetAll(Wanted);
	}
	if (ConsacPlugin::TellTwin(*this, Status))
	{
		State->Wanted ? DriveJoints() : MoveJoints();
	}
	return Status.ok();
}

TArray<double> UConsacTwinComponent::GetPose() const
{
	TArray<double> Positions;
	for (const FName Joint : GetJointNames())
	{
		Positions.Add(GetJoint(Joint));
	}
	return Positions;
}

TArray<FName> UConsacTwinComponent::GetJointNames() const
{
	TArray<FName> Names;
	if (State->Posture)
	{
		for (const std::int32_t Joint : State->Posture->robot().position_joints)
		{
			Names.Add(State->Joints[static_cast<std::size_t>(Joint)]);
		}
	}
	return Names;
}

bool UConsacTwinComponent::GetJointLimits(FName Joint, double& Lower, double& Upper) const
{
	Lower = Upper = 0.0;
	const int32 Number = State->Posture ? ConsacPlugin::NumberOf(State->Joints, Joint) : -1;
	if (Number < 0)
	{
		return false;
	}
	const consac::robot::Joint& Row = State->Posture->robot().joints[static_cast<std::size_t>(Number)];
	if (Row.position_index < 0 || !std::isfinite(Row.drive.lower) || !std::isfinite(Row.drive.upper))
	{
		return false;
	}
	Lower = ConsacPlugin::ToDegreesOrCentimetres(Row, Row.drive.lower);
	Upper = ConsacPlugin::ToDegreesOrCentimetres(Row, Row.drive.upper);
	return true;
}

TArray<FName> UConsacTwinComponent::GetEndEffectors() const
{
	TArray<FName> Names;
	if (State->Posture)
	{
		for (const std::int32_t Link : State->Posture->robot().EndLinks())
		{
			Names.Add(State->Links[static_cast<std::size_t>(Link)]);
		}
	}
	return Names;
}

bool UConsacTwinComponent::GetEndEffector(FName Link, FTransform& Pose) const
{
	Pose = FTransform();
	consac::Status Status = ConsacPlugin::NoTwin();
	if (State->Posture)
	{
		const int32 Number = Link == NAME_None ? State->Posture->robot().EndLinks()[0] : ConsacPlugin::NumberOf(State->Links, Link);
		Status = Number < 0 ? consac::Status(consac::StatusCode::kNotFound, ConsacPlugin::NoneOf("link", Link, State->Links)) : consac::Status::Ok();
		if (Status.ok())
		{
			Pose = ConsacPlugin::ToTransform(State->Posture->links()[static_cast<std::size_t>(Number)]);
		}
	}
	return ConsacPlugin::TellTwin(*this, Status);
}

USceneComponent* UConsacTwinComponent::GetLinkComponent(FName Link) const
{
	const int32 Number = State->Posture ? ConsacPlugin::NumberOf(State->Links, Link) : -1;
	if (Number <= 0) // the base is where this component is
	{
		return Number < 0 ? nullptr : const_cast<UConsacTwinComponent*>(this);
	}
	return MoverOf(Number - 1);
}

void UConsacTwinComponent::BeginPlay()
{
	Super::BeginPlay();
	Build();
}

void UConsacTwinComponent::Clear()
{
	for (const TObjectPtr<USceneComponent>& Component : Made)
	{
		if (IsValid(Component.Get()))
		{
			Component->DestroyComponent();
		}
	}
	Made.Reset();
	*State = FConsacTwinState();
}

void UConsacTwinComponent::SetTwin(UConsacTwin* NewTwin)
{
	Twin = NewTwin;
	if (HasBegunPlay())
	{
		Clear();
		Build();
	}
}

// A level that is hidden and shown again begins to play anew.
void UConsacTwinComponent::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	Clear();
	Super::EndPlay(EndPlayReason);
}

void UConsacTwinComponent::BeginDestroy()
{
	if (State.IsValid()) // a temporary object of Hot Reload has none
	{
		*State = FConsacTwinState();
	}
	Super::BeginDestroy();
}
