// Copyright CONSAC authors. MIT License.
// A twin that physics moves: each link that a joint moves is a body, held by a constraint whose X axis is the joint's. A
// constraint's limits lie evenly around where its bodies were when it was made, so it is made with each joint in its middle.
#include "ConsacTwinComponent.h"

#include "Components/ActorComponent.h"
#include "Components/PrimitiveComponent.h"
#include "ConsacCoreInclude.h"
#include "ConsacTwinState.h"
#include "ConsacTwinTable.h"
#include "GameFramework/Actor.h"
#include "PhysicsEngine/PhysicsConstraintComponent.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacPlugin
{

constexpr double TorqueUnits = 1e4; // kg cm^2/s^2 in a N m
constexpr double ForceUnits = 100.0; // kg cm/s^2 in a N
constexpr double Turn = 2.0 * consac::robot::kPiRadians;

static bool Slides(const consac::robot::Joint& Joint)
{
	return Joint.type == consac::robot::JointType::kPrismatic;
}

static bool Limited(const consac::robot::Joint& Joint)
{
	return std::isfinite(Joint.drive.lower) && std::isfinite(Joint.drive.upper);
}

// The position (rad or m) of a joint whose frame moved so; of the turns that it may have made, the one nearest to where it was.
static double PositionOf(const consac::robot::Joint& Joint, const consac::robot::Transform& Moved, double Before)
{
	if (Slides(Joint))
	{
		return Moved.position.x;
	}
	const double Angle = 2.0 * std::atan2(Moved.rotation.x, Moved.rotation.w);
	return Angle + Turn * std::round((Before - Angle) / Turn);
}

// In the middle of all limits; where there are none, at 0.
static std::vector<double> MiddleOf(const consac::robot::PositionLimits& Limits)
{
	std::vector<double> Middle;
	for (std::size_t Row = 0; Row < Limits.lower.size(); ++Row)
	{
		const double Both = Limits.lower[Row] + Limits.upper[Row];
		Middle.push_back(std::isfinite(Both) ? 0.5 * Both : 0.0);
	}
	return Middle;
}

}

UPrimitiveComponent* UConsacTwinComponent::BodyOf(int32 Link) const
{
	const int32 Number = State->Bodies[static_cast<std::size_t>(Link)].Component;
	USceneComponent* Body = Number < 0 ? nullptr : Made[Number].Get();
	return IsValid(Body) ? static_cast<UPrimitiveComponent*>(Body) : nullptr; // Hang made it
}

// The body that a link is fast to: its own, or that of the link below which it is fixed; null: the world.
UPrimitiveComponent* UConsacTwinComponent::HolderOf(int32 Link) const
{
	const consac::robot::Robot& Robot = State->Posture->robot();
	while (BodyOf(Link) == nullptr && Link > 0)
	{
		Link = Robot.joints[static_cast<std::size_t>(Link) - 1].parent;
	}
	return BodyOf(Link);
}

void UConsacTwinComponent::BuildBodies()
{
	const consac::robot::Robot& Robot = State->Posture->robot();
	for (std::size_t Joint = 0; Joint < Robot.joints.size(); ++Joint)
	{
		if (Robot.joints[Joint].position_index >= 0 && BodyOf(static_cast<int32>(Joint) + 1) == nullptr)
		{
			ConsacPlugin::TellTwin(*this, consac::Status(consac::StatusCode::kFailedPrecondition, "link " + consac::Quote(Robot.links[Joint + 1].name) +
				" has no mesh, which physics needs of each link that a joint moves; list one in Meshes. It is kinematic until then"));
			return;
		}
	}
	State->Wanted.emplace(Robot);
	CONSAC_ASSERT(State->Posture->SetAll(ConsacPlugin::MiddleOf(State->Posture->limits())).ok());
	MoveJoints();
	for (std::size_t Joint = 0; Joint < Robot.joints.size(); ++Joint)
	{
		const int32 Link = static_cast<int32>(Joint) + 1;
		if (Robot.joints[Joint].position_index < 0)
		{
			continue;
		}
		State->Bodies[Joint + 1].bSimulates = true;
		if (Robot.links[Joint + 1].inertial)
		{
			BodyOf(Link)->SetMassOverrideInKg(NAME_None, static_cast<float>(Robot.links[Joint + 1].inertial->mass), true);
		}
	}
	for (std::size_t Joint = 0; Joint < Robot.joints.size(); ++Joint)
	{
		if (Robot.joints[Joint].position_index >= 0)
		{
			BodyOf(static_cast<int32>(Joint) + 1)->SetSimulatePhysics(true);
			Constrain(static_cast<int32>(Joint));
		}
	}
	DriveJoints();
}

void UConsacTwinComponent::Constrain(int32 Joint)
{
	const consac::robot::Joint& Row = State->Posture->robot().joints[static_cast<std::size_t>(Joint)];
	const double Reference = State->Posture->At(Joint);
	const bool bSlides = ConsacPlugin::Slides(Row);
	const double Reach = ConsacPlugin::Limited(Row) ? ConsacPlugin::ToDegreesOrCentimetres(Row, std::max(Row.drive.upper - Reference, Reference - Row.drive.lower)) : 0.0;
	const double Units = bSlides ? 1.0 : ConsacPlugin::TorqueUnits; // N/m is kg/s^2
	const float Stiffness = static_cast<float>(Units * static_cast<double>(DriveStiffness));
	const float Damping = static_cast<float>(Units * (static_cast<double>(DriveDamping) + Row.drive.damping));
	const double Most = Row.drive.effort * (bSlides ? ConsacPlugin::ForceUnits : ConsacPlugin::TorqueUnits);
	const float Force = std::isfinite(Most) ? static_cast<float>(Most) : 0.0f; // 0: as much as it takes

	UPhysicsConstraintComponent* Holds = NewObject<UPhysicsConstraintComponent>(GetOwner());
	Holds->SetupAttachment(this);
	Holds->SetRelativeTransform(ConsacPlugin::ToTransform(State->Posture->links()[static_cast<std::size_t>(Joint) + 1]));
	Holds->SetDisableCollision(true);
	Holds->SetLinearXLimit(!bSlides ? LCM_Locked : Reach > 0.0 ? LCM_Limited : LCM_Free, static_cast<float>(bSlides ? Reach : 0.0));
	Holds->SetLinearYLimit(LCM_Locked, 0.0f);
	Holds->SetLinearZLimit(LCM_Locked, 0.0f);
	// A twist is told from its opposite up to half a turn: what goes further is held by its drive alone.
	const bool bTwistLimited = !bSlides && Reach > 0.0 && Reach < 180.0;
	Holds->SetAngularTwistLimit(bSlides ? ACM_Locked : bTwistLimited ? ACM_Limited : ACM_Free, static_cast<float>(bTwistLimited ? Reach : 0.0));
	Holds->SetAngularSwing1Limit(ACM_Locked, 0.0f);
	Holds->SetAngularSwing2Limit(ACM_Locked, 0.0f);
	if (bSlides)
	{
		Holds->SetLinearPositionDrive(true, false, false);
		Holds->SetLinearVelocityDrive(true, false, false);
		Holds->SetLinearDriveParams(Stiffness, Damping, Force);
	}
	else
	{
		Holds->SetAngularDriveMode(EAngularDriveMode::TwistAndSwing);
		Holds->SetOrientationDriveTwistAndSwing(true, false);
		Holds->SetAngularVelocityDriveTwistAndSwing(true, false);
		Holds->SetAngularDriveParams(Stiffness, Damping, Force);
	}
	Holds->RegisterComponent();
	Holds->SetConstrainedComponents(HolderOf(Row.parent), NAME_None, BodyOf(Joint + 1), NAME_None);
	FConsacTwinConstraint Kept;
	Kept.Component = Made.Num();
	Kept.Joint = Joint;
	Kept.Reference = Reference;
	State->Constraints.push_back(Kept);
	Made.Add(Holds);
}

// Every drive's target: how far from where its constraint was made.
void UConsacTwinComponent::DriveJoints()
{
	for (const FConsacTwinConstraint& Row : State->Constraints)
	{
		USceneComponent* Component = Made[Row.Component].Get();
		UPrimitiveComponent* Body = BodyOf(Row.Joint + 1);
		if (!IsValid(Component) || Body == nullptr)
		{
			continue;
		}
		UPhysicsConstraintComponent* Holds = static_cast<UPhysicsConstraintComponent*>(Component);
		const consac::robot::Joint& Joint = State->Posture->robot().joints[static_cast<std::size_t>(Row.Joint)];
		const double Off = ConsacPlugin::ToDegreesOrCentimetres(Joint, State->Wanted->At(Row.Joint) - Row.Reference) * (bReverseDrives ? -1.0 : 1.0);
		if (ConsacPlugin::Slides(Joint))
		{
			Holds->SetLinearPositionTarget(FVector(Off, 0.0, 0.0));
		}
		else
		{
			Holds->SetAngularOrientationTarget(FRotator(0.0, 0.0, Off));
		}
		Body->WakeRigidBody(NAME_None);
	}
}

// Where physics has put the bodies: the joints' components follow, with all that hangs on them.
void UConsacTwinComponent::ReadBodies()
{
	const consac::robot::Robot& Robot = State->Posture->robot();
	std::vector<consac::robot::Transform> Frames(Robot.links.size()); // of the links, in the world
	std::vector<double> Positions(State->Posture->positions().begin(), State->Posture->positions().end());
	Frames[0] = ConsacPlugin::FromTransform(GetComponentTransform());
	for (std::size_t Number = 0; Number < Robot.joints.size(); ++Number)
	{
		const consac::robot::Joint& Joint = Robot.joints[Number];
		const consac::robot::Transform Rest = Frames[static_cast<std::size_t>(Joint.parent)] * Joint.rest;
		const double Before = State->Posture->At(static_cast<int32>(Number));
		const UPrimitiveComponent* Body = BodyOf(static_cast<int32>(Number) + 1);
		Frames[Number + 1] = Joint.position_index >= 0 ? Rest * consac::robot::JointMotion(Joint, Before) : Rest;
		if (Body == nullptr || !State->Bodies[Number + 1].bSimulates)
		{
			continue;
		}
		Frames[Number + 1] = ConsacPlugin::FromTransform(Body->GetComponentTransform()) * Inverse(State->Bodies[Number + 1].Place);
		if (Joint.mimics < 0)
		{
			Positions[static_cast<std::size_t>(Joint.position_index)] = ConsacPlugin::PositionOf(Joint, Inverse(Rest) * Frames[Number + 1], Before);
		}
	}
	if (ConsacPlugin::TellTwin(*this, State->Posture->SetAll(Positions))) // a body may have flown off
	{
		MoveJoints();
	}
}

void UConsacTwinComponent::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction)
{
	Super::TickComponent(DeltaTime, TickType, ThisTickFunction);
	if (State->Wanted)
	{
		ReadBodies();
	}
}
